/** A vehicle that does what `/pilot` asks, without dynamics: enough to test the pilot's panel. */
import type { Vec3 } from "../src/protocol/frames.ts";
import * as encode from "./encode.ts";

export interface PilotCommand {
  type: string; sequence: number; kind: string; age_ms: number; expires_ms: number;
  velocity_m_s?: Vec3; yaw_rad_s?: number; position_m?: Vec3; yaw_rad?: number; force?: boolean;
}
interface Answer { accepted: boolean; reason: string; plan?: encode.Payload }

const REFUSED = (reason: string): Answer => ({ accepted: false, reason }), DONE: Answer = { accepted: true, reason: "" };
const STALE_S = 0.3;

export class MadeUpVehicle {
  position: Vec3 = [2, 1.5, 0.1];
  yaw = 0;
  state = "off";
  phase = "ground";
  /** Time since the last velocity that counted, when the vehicle began to hold; for tests. */
  heldAfterMs: number | null = null;
  private velocity: Vec3 = [0, 0, 0];
  private yawRate = 0;
  private goal: Vec3 | null = null;
  private sinceVelocityS = Infinity;
  private sinceStateS = 0;

  act(command: PilotCommand): Answer {
    if (command.kind === "e_stop") return this.go("error", "ground");
    if (command.kind === "velocity" && command.age_ms > 1000 * STALE_S) return REFUSED("the input is too old");
    if (this.state === "error" && command.kind !== "reset") return REFUSED("only a reset leads out of error");
    switch (command.kind) {
      case "reset": return this.go("off", "ground");
      case "toggle_engage":
        if (this.state === "off") return this.go("engaging", "ground");
        return this.state === "idle" ? this.go("disengaging", "ground") : REFUSED("not now");
      case "take_off": return this.state === "idle" ? this.take([...this.position.slice(0, 2), 1] as Vec3, "take-off") : REFUSED("engage first");
      case "velocity": return this.fly(() => this.steer(command));
      case "hold": return this.fly(() => this.take(this.position, "hold"));
      case "return": return this.fly(() => this.take([2, 1.5, 1], "return"));
      case "land": return this.fly(() => this.go("landing", "descend"));
      case "preview": case "go_to": return this.goTo(command);
      default: return REFUSED(`'${command.kind}' has no meaning`);
    }
  }

  step(dtS: number): void {
    this.sinceStateS += dtS;
    if (this.state === "engaging" && this.sinceStateS > 0.5) this.go("idle", "ground");
    if (this.state === "disengaging" && this.sinceStateS > 0.5) this.go("off", "ground");
    if (this.phase === "velocity") this.sinceVelocityS += dtS;
    if (this.phase === "velocity" && this.sinceVelocityS > STALE_S) {
      this.heldAfterMs = 1000 * this.sinceVelocityS;
      this.take(this.position, "hold");
    }
    if (this.phase === "velocity") this.move(dtS);
    if (this.goal) this.approach(dtS);
    if (this.state === "landing") {
      this.position = [this.position[0], this.position[1], Math.max(0.1, this.position[2] - 0.6 * dtS)];
      if (this.position[2] <= 0.1) this.go("idle", "ground");
    }
  }

  telemetry(pilot: string | null): object {
    return {
      state: this.state, phase: this.phase, armed: !["off", "error"].includes(this.state), battery: 0.83, height_m: this.position[2], floor_m: 0,
      speed_m_s: Math.hypot(...this.velocity), velocity_m_s: this.velocity, links: { autopilot: 0.004, laser: 0.021, "remote control": 0.05 },
      fail_safes: this.heldAfterMs !== null && this.phase === "hold" ? ["no velocity set-point"] : [], pilot,
    };
  }

  pose(): encode.Payload {
    return encode.pose(1, 0, 0.02, this.position, [0, 0, Math.sin(this.yaw / 2), Math.cos(this.yaw / 2)], [0, 0]);
  }

  private go(state: string, phase: string): Answer {
    [this.state, this.phase, this.sinceStateS, this.goal, this.velocity] = [state, phase, 0, null, [0, 0, 0]];
    return DONE;
  }

  private take(goal: Vec3, phase: string): Answer {
    this.go("flying", phase);
    this.goal = [...goal];
    return DONE;
  }

  private fly(how: () => Answer): Answer { return this.state === "flying" ? how() : REFUSED("only in flight"); }

  private steer({ velocity_m_s, yaw_rad_s }: PilotCommand): Answer {
    if (this.phase !== "velocity") this.go("flying", "velocity");
    [this.velocity, this.yawRate, this.sinceVelocityS] = [velocity_m_s ?? [0, 0, 0], yaw_rad_s ?? 0, 0];
    return DONE;
  }

  private goTo({ kind, position_m }: PilotCommand): Answer {
    const goal = position_m ?? this.position, inside = goal[0] > 0.2 && goal[0] < 3.8 && goal[1] > 0.2 && goal[1] < 2.8;
    const reason = inside ? "" : "the straight way leaves the known free space after 1.6 m";
    const shown = encode.plan(inside ? 1 : 2, reason, [...this.position, ...goal]);
    if (kind === "go_to" && inside) this.fly(() => this.take(goal, "position"));
    return { accepted: inside, reason, plan: shown };
  }

  private move(dtS: number): void {
    const [c, s] = [Math.cos(this.yaw), Math.sin(this.yaw)], [vx, vy, vz] = this.velocity;
    this.position = [this.position[0] + (c * vx - s * vy) * dtS, this.position[1] + (s * vx + c * vy) * dtS, Math.max(0.1, this.position[2] + vz * dtS)];
    this.yaw += this.yawRate * dtS;
  }

  private approach(dtS: number): void {
    const way = this.goal!.map((value, k) => value - this.position[k]), size = Math.hypot(...way), step = Math.min(1, 0.8 * dtS / Math.max(size, 1e-9));
    this.position = this.position.map((value, k) => value + step * way[k]) as Vec3;
    if (size < 0.02 && this.phase === "take-off") this.phase = "hold";
  }
}
