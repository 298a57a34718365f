import type { LiveEvent } from "../protocol/messages.ts";
import { element } from "./dom.ts";
import { figure } from "./numbers.ts";

const MOST_EVENTS = 500;

/** What happened, newest first. */
export class EventPanel {
  readonly page = element("div");
  private readonly list = element("ol", { class: "events", reversed: true });
  private readonly empty = element("p", { class: "soft" }, "Nothing has happened yet.");
  private newest = -1;

  constructor() { this.page.append(this.empty, this.list); }

  /** An event that was there before a reconnection is not shown twice. */
  add(event: LiveEvent): void {
    if (event.id <= this.newest) return;
    this.newest = event.id;
    this.empty.hidden = true;
    this.list.prepend(element("li", { "data-level": event.level },
      element("time", {}, event.time_s === null ? "" : figure(event.time_s, "s")), element("span", { class: "level" }, event.level), element("span", {}, event.text)));
    while (this.list.children.length > MOST_EVENTS) this.list.lastElementChild!.remove();
  }

  clear(): void {
    this.list.replaceChildren();
    this.newest = -1;
    this.empty.hidden = false;
  }
}
