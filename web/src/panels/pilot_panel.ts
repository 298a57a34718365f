import { MachineDrawing, plainState } from "../pilot/machine_drawing.ts";
import { PilotClient, type PilotListener } from "../pilot/pilot_client.ts";
import { add, atRest, fromGamepad, fromKeys, fromSticks, isFlightKey, REST, velocityOf } from "../pilot/pilot_inputs.ts";
import type { Answer, CommandKind, Holder } from "../pilot/pilot_link.ts";
import { Stick } from "../pilot/stick.ts";
import type { Plan, Pose, Vec3 } from "../protocol/frames.ts";
import type { Vehicle } from "../protocol/messages.ts";
import { byId, element, titled, toggle } from "./dom.ts";
import { figure } from "./numbers.ts";

const INPUT_EVERY_MS = 50, TURN_RAD_S = 1;
const COMMANDS: [CommandKind, string][] = [
  ["toggle_engage", "Engage"], ["take_off", "Take off"], ["hold", "Hold"], ["land", "Land"], ["return", "Return"], ["reset", "Reset"],
];

/** What flies the vehicle: lease, commands, sticks, keys, gamepad, going to a point that is chosen in the model. */
export class PilotPanel implements PilotListener {
  readonly page = element("div");
  /** The next click in the model chooses where to go. */
  choosing = false;
  onKeysTaken: (taken: boolean) => void = () => {};
  onChoosing: () => void = () => {};
  private readonly client: PilotClient;
  private readonly machine = new MachineDrawing();
  private readonly reason = element("p", { class: "reason", role: "status" });
  private readonly lease = element("div", { class: "buttons" });
  private readonly values = element("dl", { class: "values" });
  private readonly buttons = new Map<CommandKind, HTMLButtonElement>();
  private readonly go = element("button", { type: "button", onclick: () => this.choose(!this.choosing) }, "Go to a point");
  private readonly confirm = element("button", { type: "button", class: "main", hidden: true, onclick: () => this.flyThere() }, "Fly there");
  private readonly speed = element("input", { type: "range", min: 0.1, max: 1.5, step: 0.1, value: 0.5, "aria-label": "Full speed", id: "speed" });
  private readonly sticks = [new Stick("turn · climb"), new Stick("go")];
  private readonly keys = new Set<string>();
  private keysFly = false;
  private sticksWanted = matchMedia("(pointer: coarse)").matches;
  private connected = false;
  private holder: Holder = "none";
  private steering = false;
  private goal: { position: Vec3; yaw: number } | null = null;
  private vehicle: Vehicle | null = null;
  private place: Pose | null = null;
  private roundTripMs: number | null = null;

  constructor(url: string) {
    this.client = new PilotClient("pilot_worker.js", url, this);
    this.build();
    this.listenToKeys();
    setInterval(() => this.readInputs(), INPUT_EVERY_MS);
    this.showLease();
  }

  /** The place that a click chose, on a surface with this normal or (null) in the air: its preview comes as a plan. */
  preview(point: Vec3, normal: Vec3 | null): void {
    const [x, y, z] = this.place?.position ?? point;
    const isFloor = normal !== null && normal[2] > 0.7, height = isFloor ? Math.max(z, point[2] + 0.5) : z;
    const position: Vec3 = !normal || isFloor ? [point[0], point[1], height] : point.map((value, k) => value + 0.8 * normal[k]) as Vec3;
    this.goal = { position, yaw: Math.atan2(position[1] - y, position[0] - x) };
    this.client.command("preview", { position_m: position, yaw_rad: this.goal.yaw });
    this.choose(false);
  }

  plan(plan: Plan): void {
    this.confirm.hidden = !(plan.state === "valid" && this.goal);
    if (plan.state === "refused") this.refusePreview(plan.reason);
    else if (plan.state === "valid" && this.goal) this.say("The way is free", "ok");
  }

  pose(pose: Pose): void {
    if (pose.which === "vehicle") this.place = pose;
  }

  update(vehicle: Vehicle): void {
    this.vehicle = vehicle;
    this.machine.show(vehicle.state, vehicle.phase ?? "");
    this.buttons.get("toggle_engage")!.textContent = plainState(vehicle.state) === "off" ? "Engage" : "Disengage";
    const rows: [string, string][] = [
      ["battery", vehicle.battery == null ? "-" : `${Math.round(100 * vehicle.battery)} %`], ["height", figure(vehicle.height_m, "m")], ["speed", figure(vehicle.speed_m_s, "m/s")],
      ...Object.entries(vehicle.links ?? {}).map(([name, age]): [string, string] => [`${name}, last sign`, age === null ? "never" : figure(1000 * age, "ms")]),
      ["button to answer", this.roundTripMs === null ? "-" : figure(this.roundTripMs, "ms")], ["who flies", vehicle.pilot ?? "nobody"],
    ];
    this.values.replaceChildren(...rows.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]),
                                ...(vehicle.fail_safes ?? []).flatMap(words => [element("dt", {}, "fail-safe"), element("dd", {}, words)]));
    this.enable();
  }

  onConnected(connected: boolean, reason: string): void {
    this.connected = connected;
    this.showLease();
    if (connected) this.say("", "");
    else this.say(`No link to the vehicle: ${reason}`, "bad");
  }
  onLease(holder: Holder): void {
    this.holder = holder;
    this.showLease();
  }
  onAnswer({ kind, accepted, reason, roundTripMs }: Answer): void {
    this.roundTripMs = roundTripMs;
    if (kind === "preview" && !accepted) this.refusePreview(reason);
    else if (!accepted) this.say(`Refused (${plainState(kind)}): ${reason}`, "bad");
    else if (kind === "e_stop") this.say("Motors cut", "bad");
    else if (kind !== "velocity" && kind !== "preview") this.say(`Done: ${plainState(kind)}`, "ok");
  }

  /** Cuts the motors; needs no lease. */
  stop(): void { this.client.command("e_stop"); }

  private build(): void {
    for (const [kind, words] of COMMANDS) {
      const button = element("button", { type: "button", onclick: () => this.client.command(kind) }, words);
      this.buttons.set(kind, button);
    }
    const stop = element("button", { type: "button", class: "stop", title: "Cuts the motors (space bar)", onclick: () => this.stop() }, "STOP");
    byId("stop-corner").append(stop);
    byId("stop-corner").hidden = false;
    byId("sticks").append(...this.sticks.map(stick => stick.box));
    const coarse = this.sticksWanted, speedText = element("output", { for: "speed" }, "0.5 m/s");
    this.speed.addEventListener("input", () => { speedText.textContent = `${this.speed.value} m/s`; });
    this.page.append(this.reason, titled("Who flies", this.lease), titled("State", this.machine.svg as unknown as HTMLElement),
      titled("Commands", element("div", { class: "buttons" }, ...this.buttons.values())),
      titled("Way", element("div", { class: "buttons" }, this.go, this.confirm)),
      titled("Steering", element("div", { class: "slider" }, this.speed, speedText),
             toggle("touch sticks", coarse, on => {
               this.sticksWanted = on;
               this.showLease();
             }),
             toggle("keys fly (W A S D, arrows)", false, on => this.setKeysFly(on))),
      titled("Vehicle", this.values));
  }

  private listenToKeys(): void {
    window.addEventListener("keydown", event => {
      if (!this.keysFly || !isFlightKey(event.code) || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      this.keys.add(event.code);
    }, { capture: true });
    window.addEventListener("keyup", event => this.keys.delete(event.code));
    window.addEventListener("blur", () => this.letGo());
    document.addEventListener("visibilitychange", () => { if (document.hidden) this.letGo(); });
  }

  private letGo(): void {
    this.keys.clear();
    this.sticks.forEach(stick => stick.release());
  }

  private setKeysFly(on: boolean): void {
    this.keysFly = on;
    this.keys.clear();
    this.onKeysTaken(on);
  }

  /** Read again and again, so that a page which hangs sends nothing. */
  private readInputs(): void {
    const [left, right] = this.sticks, pad = navigator.getGamepads?.().find(found => found?.connected && found.mapping === "standard");
    const axes = add(fromKeys(this.keys), fromSticks(left.x, left.y, right.x, right.y), pad && document.hasFocus() ? fromGamepad(pad.axes) : REST);
    const moving = !atRest(axes);
    if (this.holder === "you" && (moving || this.steering))
      this.client.steer({ velocity: velocityOf(axes, Number(this.speed.value)), yawRate: TURN_RAD_S * axes.turn });
    this.steering = moving;
  }

  /** Whether the next click in the model chooses where to go. */
  choose(on: boolean): void {
    this.choosing = on;
    if (on) this.goal = null;
    this.confirm.hidden = true;
    this.go.classList.toggle("main", on);
    byId("hint").hidden = !on;
    byId("hint").textContent = "Choose where to go: the vehicle keeps its height over a floor";
    byId("stage").dataset.tool = on ? "go" : "";
    this.onChoosing();
  }

  private flyThere(): void {
    if (this.goal) this.client.command("go_to", { position_m: this.goal.position, yaw_rad: this.goal.yaw });
    this.confirm.hidden = true;
    this.goal = null;
  }

  private refusePreview(reason: string): void {
    this.confirm.hidden = true;
    this.say(`No way there: ${reason}`, "bad");
  }

  private showLease(): void {
    const words = { you: "You fly", other: "Another pilot flies", none: "Nobody flies" }[this.holder];
    const button = this.holder === "you" ? element("button", { type: "button", onclick: () => this.client.release() }, "Give up control")
      : element("button", { type: "button", class: "main", disabled: !this.connected, onclick: () => this.client.take(this.holder === "other") }, this.holder === "other" ? "Take over" : "Take control");
    this.lease.replaceChildren(element("strong", {}, this.connected ? words : "No link to the vehicle yet"), button);
    byId("sticks").hidden = !(this.sticksWanted && this.holder === "you");
    this.enable();
  }

  /** Commands that cannot be carried out now; the vehicle decides all the same. */
  private enable(): void {
    const state = plainState(this.vehicle?.state ?? ""), flies = state === "flying";
    const allowed: Partial<Record<CommandKind, boolean>> = {
      toggle_engage: state === "off" || state === "idle", take_off: state === "idle", hold: flies || state === "landing", land: flies, return: flies, reset: state === "error",
    };
    for (const [kind, button] of this.buttons) button.disabled = this.holder !== "you" || !allowed[kind];
    this.go.disabled = this.holder !== "you" || !flies;
  }

  private say(words: string, level: "ok" | "bad" | ""): void {
    this.reason.textContent = words;
    this.reason.dataset.level = level;
  }
}
