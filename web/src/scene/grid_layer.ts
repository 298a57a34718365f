import { DataTexture, GLSL3, Group, Mesh, NearestFilter, PlaneGeometry, RawShaderMaterial, RedFormat, UnsignedByteType } from "three";
import type { Ray } from "../measure/raycast.ts";
import type { Box, GridTile, Vec3 } from "../protocol/frames.ts";

const VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
in vec3 position;
in vec2 uv;
out vec2 place;
void main() { place = uv; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`;

const FRAGMENT = `
precision highp float;
uniform sampler2D cells;
in vec2 place;
out vec4 result;
void main() {
  float value = texture(cells, place).r * 255.0;
  if (value < 0.5) discard;
  float share = (value - 1.0) / 254.0;
  result = vec4(mix(vec3(0.56, 0.79, 0.95), vec3(0.85, 0.33, 0.08), smoothstep(0.3, 0.7, share)), mix(0.28, 0.85, share));
}`;

interface Tile { version: number; mesh: Mesh<PlaneGeometry, RawShaderMaterial>; texture: DataTexture; tile: GridTile }

/** A level slice of the occupancy map, by tiles. */
export class GridLayer {
  readonly group = new Group();
  private readonly tiles = new Map<string, Tile>();

  set(tile: GridTile): void {
    const name = tile.key.join(), old = this.tiles.get(name);
    if (old && old.version > tile.version) return;
    if (old) this.drop(name, old);
    const texture = new DataTexture(tile.cells, tile.side, tile.side, RedFormat, UnsignedByteType);
    texture.minFilter = texture.magFilter = NearestFilter;
    texture.unpackAlignment = 1;
    texture.needsUpdate = true;
    const size = tile.side * tile.cellM, mesh = new Mesh(new PlaneGeometry(size, size), new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, transparent: true, depthWrite: false, side: 2,
      uniforms: { cells: { value: texture } },
    }));
    mesh.position.set((tile.key[0] + 0.5) * size, (tile.key[1] + 0.5) * size, tile.heightM);
    this.group.add(mesh);
    this.tiles.set(name, { version: tile.version, mesh, texture, tile });
  }

  /** Box of the cells that are known, or null. */
  box(): Box | null {
    const low: Vec3 = [Infinity, Infinity, Infinity], high: Vec3 = [-Infinity, -Infinity, -Infinity];
    for (const { tile } of this.tiles.values())
      tile.cells.forEach((value, i) => {
        if (value === 0) return;
        [tile.key[0] * tile.side + i % tile.side, tile.key[1] * tile.side + Math.floor(i / tile.side)].forEach((cell, k) => {
          low[k] = Math.min(low[k], cell * tile.cellM);
          high[k] = Math.max(high[k], (cell + 1) * tile.cellM);
        });
        low[2] = Math.min(low[2], tile.heightM);
        high[2] = Math.max(high[2], tile.heightM);
      });
    return low[0] <= high[0] ? { low, high } : null;
  }

  /** Where the ray meets a known cell of the slice, or null. */
  meet({ origin, direction }: Ray): Vec3 | null {
    for (const { tile } of this.tiles.values()) {
      const way = (tile.heightM - origin[2]) / direction[2], size = tile.side * tile.cellM;
      const [x, y] = [0, 1].map(k => origin[k] + way * direction[k]), cell = [x, y].map((value, k) => Math.floor((value - tile.key[k] * size) / tile.cellM));
      if (!(way > 0) || cell.some(value => value < 0 || value >= tile.side)) continue;
      if (tile.cells[cell[1] * tile.side + cell[0]] > 0) return [x, y, tile.heightM];
    }
    return null;
  }

  clear(): void {
    for (const [name, tile] of [...this.tiles]) this.drop(name, tile);
  }

  private drop(name: string, { mesh, texture }: Tile): void {
    this.group.remove(mesh);
    mesh.geometry.dispose();
    mesh.material.dispose();
    texture.dispose();
    this.tiles.delete(name);
  }
}
