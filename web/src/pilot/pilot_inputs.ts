import type { Vec3 } from "../protocol/frames.ts";

/** Shares of full speed, -1 to 1: ahead, left, up, turn to the left. */
export interface Axes { ahead: number; left: number; up: number; turn: number }

export const REST: Axes = { ahead: 0, left: 0, up: 0, turn: 0 };
const DEAD_BAND = 0.12;
const KEYS: Record<string, Partial<Axes>> = {
  KeyW: { ahead: 1 }, KeyS: { ahead: -1 }, KeyA: { left: 1 }, KeyD: { left: -1 },
  ArrowUp: { up: 1 }, ArrowDown: { up: -1 }, ArrowLeft: { turn: 1 }, ArrowRight: { turn: -1 },
};
export const isFlightKey = (code: string): boolean => code in KEYS;

const clamp = (value: number): number => Math.max(-1, Math.min(1, value));

/** Nothing near the middle, then rising from 0. */
export function withDeadBand(value: number): number {
  const size = Math.abs(value);
  return size <= DEAD_BAND ? 0 : Math.sign(value) * Math.min((size - DEAD_BAND) / (1 - DEAD_BAND), 1);
}

export function fromKeys(held: Iterable<string>): Axes {
  return add(...[...held].map(code => ({ ...REST, ...KEYS[code] })));
}

/** Two sticks, each x to the right and y up: left climbs and turns, right goes (mode 2 of remote controls). */
export function fromSticks(leftX: number, leftY: number, rightX: number, rightY: number): Axes {
  return { turn: -withDeadBand(leftX), up: withDeadBand(leftY), left: -withDeadBand(rightX), ahead: withDeadBand(rightY) };
}

/** The standard layout: y of both sticks grows downwards. */
export function fromGamepad(axes: readonly number[]): Axes {
  const [leftX = 0, leftY = 0, rightX = 0, rightY = 0] = axes;
  return fromSticks(leftX, -leftY, rightX, -rightY);
}

export function add(...all: Axes[]): Axes {
  const sum = (name: keyof Axes): number => clamp(all.reduce((total, axes) => total + axes[name], 0));
  return { ahead: sum("ahead"), left: sum("left"), up: sum("up"), turn: sum("turn") };
}

export const atRest = (axes: Axes): boolean => axes.ahead === 0 && axes.left === 0 && axes.up === 0 && axes.turn === 0;

/** Velocity in the vehicle's level frame (x ahead, y left, z up), m/s; slower upwards and downwards. */
export function velocityOf({ ahead, left, up }: Axes, speedMS: number): Vec3 {
  const level = Math.max(1, Math.hypot(ahead, left));
  return [ahead / level * speedMS, left / level * speedMS, 0.6 * up * speedMS];
}
