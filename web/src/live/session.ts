import { readFrame, readHeader, type Frame } from "../protocol/frames.ts";
import type { Hello } from "../protocol/messages.ts";
import { PageSet } from "../protocol/page_set.ts";
import { FrameError } from "../protocol/reader.ts";

const LEVELS_A_MESSAGE = 1000;
const FIRST_PAUSE_S = 0.5, LONGEST_PAUSE_S = 5;

/** What came of a message: a frame to show, and what to send. `cleared`: all that is shown belongs to another session. */
export interface Received { frame: Frame | null; send: string[]; cleared: boolean }

/**
 * The rules of `/live` on the viewer's side, without a socket: order of frames, resuming after the server was lost, which
 * pages are news, how long to wait before the next attempt.
 */
export class LiveSession {
  readonly pages = new PageSet();
  skipped = 0;   // frames of unknown kinds
  refused = 0;   // messages that broke the rules
  outdated = 0;  // pages that are older than what is there, or there already
  private sequence = 0;
  private hello: Hello | null = null;
  private pauseS = FIRST_PAUSE_S;

  get newestSequence(): number { return this.sequence; }

  /** A connection was opened: its sequence starts anew. */
  opened(): void { this.sequence = 0; }

  /** Seconds until the next attempt; longer after each, up to 5. */
  nextPauseS(): number {
    const pause = this.pauseS;
    this.pauseS = Math.min(2 * this.pauseS, LONGEST_PAUSE_S);
    return pause;
  }

  /** Reads a message; throws FrameError where it breaks the rules, and nothing is changed by it. */
  receive(bytes: Uint8Array): Received {
    try {
      return this.accept(bytes);
    } catch (error) {
      ++this.refused;
      throw error;
    }
  }

  private accept(bytes: Uint8Array): Received {
    const { sequence } = readHeader(bytes);
    if (sequence !== this.sequence + 1) throw new FrameError(`frame ${sequence} came after frame ${this.sequence}`);
    const frame = readFrame(bytes);
    if ((frame.kind === "hello") !== (sequence === 1)) throw new FrameError("hello has to be the first frame, and only that");
    this.sequence = sequence;
    if (frame.kind === "hello") return this.greet(frame);
    const news = this.isNews(frame);
    return { frame: news ? frame : null, send: [], cleared: false };
  }

  private isNews(frame: Frame): boolean {
    if (frame.kind === "unknown") {
      ++this.skipped;
      return false;
    }
    if (frame.kind === "meshPage" && !this.pages.accept(frame.page.key, frame.page.version, frame.page.level)) {
      ++this.outdated;
      return false;
    }
    if (frame.kind === "pageGone") return this.pages.remove(frame.gone.key, frame.gone.version);
    return true;
  }

  private greet(frame: Frame & { kind: "hello" }): Received {
    const cleared = this.hello !== null && this.hello.session !== frame.hello.session;
    if (cleared) this.pages.clear();
    this.hello = frame.hello;
    this.pauseS = FIRST_PAUSE_S;
    const parts = this.pages.describe(LEVELS_A_MESSAGE);
    const send = parts.map((pages, i) => JSON.stringify({
      type: "hello", protocol: frame.hello.protocol, session: frame.hello.session, all_levels: true, pages, more: i + 1 < parts.length,
    }));
    return { frame, send, cleared };
  }
}
