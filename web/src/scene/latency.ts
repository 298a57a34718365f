import { sharedClockMs, type ShownFrame } from "../live/worker_messages.ts";
import type { MeshPage } from "../protocol/mesh_page.ts";

const KEPT = 2000;

/** How long changes of the model and poses took until a picture with them was finished, ms: the last ones. */
export class Latency {
  readonly pages: number[] = [];
  readonly poses: number[] = [];
  private shown: [number[], number][] = [];  // not in a picture yet: where it counts, and since when
  private inPicture: [number[], number][] = [];

  /** A frame is about to be shown. Of a page, the first level of a version counts, from the change in the map on. */
  note(frame: ShownFrame, receivedMs: number, mesh: { has(page: MeshPage): boolean }): void {
    if (frame.kind === "pose") this.shown.push([this.poses, receivedMs]);
    if (frame.kind === "meshPage" && !mesh.has(frame.page)) this.shown.push([this.pages, receivedMs - 1000 * frame.page.ageS]);
  }

  /** What was noted so far is in the picture that is drawn now. */
  drawn(): void {
    this.inPicture.push(...this.shown);
    this.shown = [];
  }

  /** That picture is finished. */
  finished(): void {
    const now = sharedClockMs();
    for (const [list, since] of this.inPicture) {
      list.push(now - since);
      if (list.length > KEPT) list.splice(0, KEPT / 2);
    }
    this.inPicture = [];
  }
}
