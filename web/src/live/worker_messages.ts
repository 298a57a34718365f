import type { Frame, GridTile, PageKey } from "../protocol/frames.ts";
import type { MeshPage } from "../protocol/mesh_page.ts";

/** Frames as the page shows them: mesh pages are decoded. */
export type ShownFrame = Exclude<Frame, { kind: "meshPage" } | { kind: "unknown" }> | { kind: "meshPage"; page: MeshPage };

/** The clock that a Worker and its page have in common, ms. */
export const sharedClockMs = (): number => performance.timeOrigin + performance.now();

export interface LinkCounts { bytes: number; frames: number; skipped: number; refused: number; outdated: number }

/** Names a frame: the how manieth connection it came by, and its sequence there. */
export interface Receipt { connection: number; sequence: number }

/** A frame, and when it was received (sharedClockMs). */
export interface TimedFrame { frame: ShownFrame; receivedMs: number }

/** Edges of a page that are open in the model, six numbers each; none: nothing is drawn there any more. */
export interface OpenEdges { key: PageKey; ends: Float32Array }

/** Frontiers of a tile of the occupancy slice, as those. */
export interface TileFrontiers { key: GridTile["key"]; ends: Float32Array }

export type FromWorker =
  /** In the order in which they came; the receipt is that of the last one. */
  | { type: "frames"; receipt: Receipt; frames: TimedFrame[] }
  | { type: "openEdges"; pages: OpenEdges[] }
  | { type: "frontiers"; tiles: TileFrontiers[] }
  | { type: "cleared" }
  | { type: "state"; state: "connecting" | "open" | "lost"; reason: string; retryS: number }
  | { type: "counts"; counts: LinkCounts };

export type ToWorker =
  | { type: "start"; url: string }
  | { type: "shown"; receipt: Receipt }
  | { type: "send"; text: string }
  | { type: "retry" };
