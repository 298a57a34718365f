import { DataTexture, GLSL3, Group, Mesh, NearestFilter, PlaneGeometry, RawShaderMaterial, RedFormat, UnsignedByteType } from "three";
import type { GridTile } from "../protocol/frames.ts";

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

  all(): GridTile[] { return [...this.tiles.values()].map(({ tile }) => tile); }

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
