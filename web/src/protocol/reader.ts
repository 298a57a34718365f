/** A frame or message that breaks the rules of the live view (docs/file_formats.md). */
export class FrameError extends Error {}

/** Reads little-endian values one after the other; every read beyond the end is a FrameError. */
export class Reader {
  private readonly view: DataView;
  private at = 0;

  constructor(private readonly bytes: Uint8Array) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  get left(): number { return this.bytes.byteLength - this.at; }

  u8(): number { return this.view.getUint8(this.take(1)); }
  u16(): number { return this.view.getUint16(this.take(2), true); }
  u32(): number { return this.view.getUint32(this.take(4), true); }
  i32(): number { return this.view.getInt32(this.take(4), true); }
  f32(): number { return this.view.getFloat32(this.take(4), true); }
  f64(): number { return this.view.getFloat64(this.take(8), true); }
  i64(): bigint { return this.view.getBigInt64(this.take(8), true); }
  skip(count: number): void { this.take(count); }

  /** The next bytes, not copied. */
  part(count: number): Uint8Array {
    const begin = this.take(count);
    return this.bytes.subarray(begin, begin + count);
  }

  text(count: number): string {
    const bytes = this.part(count);
    try {
      return new TextDecoder("utf-8", { fatal: true }).decode(bytes);
    } catch {
      throw new FrameError("a text that is not UTF-8");
    }
  }

  /** `count` points of three f32 each, copied (they need not be aligned). */
  points(count: number): Float32Array {
    const bytes = this.part(12 * count), points = new Float32Array(3 * count);
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    for (let i = 0; i < points.length; ++i) points[i] = view.getFloat32(4 * i, true);
    return points;
  }

  /** Everything has to be read. */
  end(): void {
    if (this.left > 0) throw new FrameError(`${this.left} bytes more than the frame should have`);
  }

  private take(count: number): number {
    if (count > this.left) throw new FrameError(`the frame ends after ${this.bytes.byteLength} bytes, ${count - this.left} too early`);
    const begin = this.at;
    this.at += count;
    return begin;
  }
}
