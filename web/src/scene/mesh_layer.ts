import { BufferAttribute, BufferGeometry, Group, IntType, Mesh, Sphere, Vector3 } from "three";
import type { PageKey, Vec3 } from "../protocol/frames.ts";
import type { MeshPage } from "../protocol/mesh_page.ts";
import { MeshMaterials, type ColorMode } from "./mesh_material.ts";
import type { Box } from "./camera_rig.ts";

interface Shown { page: MeshPage; mesh: Mesh; changedAtS: number }

const nowS = (): number => performance.now() / 1000;

/** The model: one three mesh a page, culled by its sphere. */
export class MeshLayer {
  readonly group = new Group();
  readonly materials = new MeshMaterials();
  private readonly shown = new Map<string, Shown>();
  private mode: ColorMode = "colour";
  private triangles = 0;

  constructor() { this.group.matrixAutoUpdate = false; }

  get triangleCount(): number { return this.triangles; }
  get pageCount(): number { return this.shown.size; }
  pages(): Iterable<MeshPage> { return pagesOf(this.shown.values()); }

  set(page: MeshPage): void {
    this.remove(page.key);
    const mesh = new Mesh(geometryOf(page));
    const changedAtS = nowS() - page.ageS;
    mesh.matrixAutoUpdate = false;
    mesh.matrix.makeScale(page.quantum, page.quantum, page.quantum).setPosition(...page.origin);
    mesh.material = this.materials.of(page.hasColors, page.ageS);
    this.group.add(mesh);
    mesh.updateMatrixWorld(true);
    mesh.matrixWorldAutoUpdate = false;
    this.shown.set(page.key.join(), { page, mesh, changedAtS });
    this.triangles += page.indices.length / 3;
  }

  remove(key: PageKey): void {
    const old = this.shown.get(key.join());
    if (!old) return;
    this.triangles -= old.page.indices.length / 3;
    this.group.remove(old.mesh);
    old.mesh.geometry.dispose();
    this.shown.delete(key.join());
  }

  clear(): void {
    for (const { page } of [...this.shown.values()]) this.remove(page.key);
  }

  setMode(mode: ColorMode): void {
    this.mode = mode;
    this.materials.setMode(mode);
    this.assignMaterials();
  }

  /** Ages pass: to be called now and then; true where something changed. */
  passTime(): boolean {
    if (this.mode === "age") this.assignMaterials();
    return this.mode === "age";
  }

  /** Box of all vertices, or null. */
  box(): Box | null {
    const low: Vec3 = [Infinity, Infinity, Infinity], high: Vec3 = [-Infinity, -Infinity, -Infinity];
    for (const { page } of this.shown.values())
      for (let k = 0; k < 3; ++k) {
        low[k] = Math.min(low[k], page.low[k]);
        high[k] = Math.max(high[k], page.high[k]);
      }
    return this.shown.size ? { low, high } : null;
  }

  private assignMaterials(): void {
    const now = nowS();
    for (const { page, mesh, changedAtS } of this.shown.values()) mesh.material = this.materials.of(page.hasColors, now - changedAtS);
  }
}

function* pagesOf(shown: Iterable<Shown>): Iterable<MeshPage> {
  for (const { page } of shown) yield page;
}

function geometryOf(page: MeshPage): BufferGeometry {
  const geometry = new BufferGeometry();
  const positions = new BufferAttribute(page.positions, 4);
  positions.gpuType = IntType;
  geometry.setAttribute("position", positions);
  geometry.setAttribute("tint", new BufferAttribute(page.tints, 4, true));
  geometry.setIndex(new BufferAttribute(page.indices, 1));
  // Of the mesh's own frame: quanta from the origin.
  const center = new Vector3(), low = new Vector3(...page.low), high = new Vector3(...page.high), origin = new Vector3(...page.origin);
  center.addVectors(low, high).multiplyScalar(0.5).sub(origin).divideScalar(page.quantum);
  geometry.boundingSphere = new Sphere(center, low.distanceTo(high) / 2 / page.quantum);
  return geometry;
}
