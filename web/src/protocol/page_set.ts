import type { PageKey } from "./frames.ts";

interface Known { version: number; levels: Set<number> }

/** Which state of each page a viewer has. Of one page the newest version counts; what is gone stays gone until a newer version arrives. */
export class PageSet {
  private readonly pages = new Map<string, Known>();
  private readonly gone = new Map<string, number>();

  get size(): number { return this.pages.size; }
  clear(): void {
    this.pages.clear();
    this.gone.clear();
  }

  /** True where the page is news and has been noted; false where something newer, or the same level, is there. */
  accept(key: PageKey, version: number, level: number): boolean {
    const name = key.join(), known = this.pages.get(name), goneAt = this.gone.get(name);
    if (goneAt !== undefined && goneAt >= version) return false;
    if (known && known.version === version) {
      if (known.levels.has(level)) return false;
      known.levels.add(level);
      return true;
    }
    if (known && known.version > version) return false;
    this.pages.set(name, { version, levels: new Set([level]) });
    this.gone.delete(name);
    return true;
  }

  /** True where a page is taken away by it. */
  remove(key: PageKey, version: number): boolean {
    const name = key.join(), known = this.pages.get(name);
    if (known && known.version > version) return false;
    this.gone.set(name, version);
    return this.pages.delete(name);
  }

  /** The page could not be shown after all: it is to be sent again. */
  forget(key: PageKey): void { this.pages.delete(key.join()); }

  /** x, y, z, version, level of each level of each page, in parts of at most `most` levels; at least one part. */
  describe(most: number): number[][] {
    const parts: number[][] = [[]];
    for (const [name, { version, levels }] of this.pages)
      for (const level of levels) {
        if (parts[parts.length - 1].length >= 5 * most) parts.push([]);
        parts[parts.length - 1].push(...name.split(",").map(Number), version, level);
      }
    return parts;
  }
}
