import type { MeshPage } from "../protocol/mesh_page.ts";

/** The triangles of the level that is drawn may have sides of so many pixels; more before a coarse level that is drawn gives way. */
const MOST_SIDE_PX = 2, KEPT_SIDE_PX = 2.5;

/** About the side of a page's triangles, m: that of so many as cover a square as wide as the page. */
export function triangleSide({ low, high, indices }: MeshPage): number {
  return Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]) / Math.sqrt(Math.max(indices.length / 6, 1));
}

/**
 * Which level of a page to draw where a pixel covers `pixelM` metres of it: the coarsest that is fine enough, else the finest.
 * `sidesM`: of the triangles of each level, undefined for a level that has not come, one at least has; `drawn`: the level
 * that is drawn now, so that none is chosen again at every small move.
 */
export function chooseLevel(sidesM: readonly (number | undefined)[], pixelM: number, drawn: number): number {
  for (let level = sidesM.length - 1; level > 0; --level) {
    const side = sidesM[level];
    if (side !== undefined && side <= (level <= drawn ? KEPT_SIDE_PX : MOST_SIDE_PX) * pixelM) return level;
  }
  return sidesM.findIndex(side => side !== undefined);
}
