// The city's mesh: read from glTF binary, merged into tiles with one colour attribute each.

import {
  BufferAttribute, BufferGeometry, Color, DoubleSide, EdgesGeometry, Group, LineBasicMaterial, LineSegments, Mesh,
  MeshBasicMaterial, type Intersection, type Raycaster,
} from 'three';
import type { CityObject } from './format';
import { lightOfTriangles, lit } from './light';
import { coloured } from './lines';
import { kMaterialColours, kPaint, type Theme } from './palette';

interface Gltf {
  nodes: { mesh?: number; translation?: [number, number, number] }[];
  meshes: { primitives: { attributes: { POSITION: number }; indices: number; material: number }[] }[];
  accessors: { bufferView: number; byteOffset?: number; count: number }[];
  bufferViews: { byteOffset?: number; byteLength: number }[];
  materials: { name: string }[];
}

/** Side of a tile [m]: tiles outside the picture are not drawn. */
const kTile = 500;
/** Above this number of triangles, edges of buildings are omitted: they would double the cost. */
const kMostEdged = 120_000;

class Tile {
  positions: number[] = [];
  objects: number[] = [];
  materials: number[] = [];
}

export class CityMesh {
  readonly group = new Group();
  readonly objects: CityObject[];
  /** x, y, z of the lowest and the highest corner of objects on the ground. */
  readonly low: [number, number, number] = [Infinity, Infinity, Infinity];
  readonly high: [number, number, number] = [-Infinity, -Infinity, -Infinity];
  private readonly meshes: Mesh[] = [];
  private readonly edges: LineSegments[] = [];
  private readonly materialNames: string[];
  private readonly highest: number;
  private highlight: Mesh | null = null;

  constructor(glb: ArrayBuffer, objects: CityObject[]) {
    this.objects = objects;
    const view = new DataView(glb);
    const jsonBytes = view.getUint32(12, true);
    const gltf = JSON.parse(new TextDecoder().decode(new Uint8Array(glb, 20, jsonBytes))) as Gltf;
    const binary = 20 + jsonBytes + 8;
    this.materialNames = gltf.materials.map((m) => m.name);
    this.highest = objects.reduce((most, o) => (o.surface === 'building' ? Math.max(most, o.high_m - o.low_m) : most), 20);
    const tiles = this.sortIntoTiles(gltf, glb, binary);
    let triangles = 0;
    for (const tile of tiles.values()) triangles += tile.objects.length;
    for (const tile of tiles.values()) this.addTile(tile, triangles <= kMostEdged);
  }

  private sortIntoTiles(gltf: Gltf, glb: ArrayBuffer, binary: number): Map<string, Tile> {
    const tiles = new Map<string, Tile>();
    let object = -1;
    for (const node of gltf.nodes) {
      if (node.mesh === undefined) continue;
      ++object;  // nodes and the header's objects have the same order
      const [tx, ty, tz] = node.translation ?? [0, 0, 0];
      for (const primitive of gltf.meshes[node.mesh]?.primitives ?? []) {
        const at = (accessor: number): [number, number] => {
          const a = gltf.accessors[accessor];
          const v = a && gltf.bufferViews[a.bufferView];
          if (!a || !v) throw new Error('the city has a broken glTF');
          return [binary + (v.byteOffset ?? 0) + (a.byteOffset ?? 0), a.count];
        };
        const [p, vertices] = at(primitive.attributes.POSITION);
        const [i, indices] = at(primitive.indices);
        const position = new Float32Array(glb.slice(p, p + 12 * vertices));
        const index = new Uint32Array(glb.slice(i, i + 4 * indices));
        // glTF: x east, y up, z south. Tiles by the object's first corner; for terrain by each triangle's, since terrain spans the city.
        const terrain = this.objects[object]?.surface === 'terrain';
        let place: [number, number] | null = null;
        for (let t = 0; t < indices; t += 3) {
          const corners: number[] = [];
          for (let k = 0; k < 3; ++k) {
            const v = 3 * (index[t + k] ?? 0);
            corners.push((position[v] ?? 0) + tx, -((position[v + 2] ?? 0) + tz), (position[v + 1] ?? 0) + ty);
          }
          if (terrain || !place) place = [corners[0] ?? 0, corners[1] ?? 0];
          const [x, y] = place;
          const key = `${Math.floor(x / kTile)},${Math.floor(y / kTile)}`;
          let tile = tiles.get(key);
          if (!tile) tiles.set(key, (tile = new Tile()));
          for (const c of corners) tile.positions.push(c);
          tile.objects.push(object);
          tile.materials.push(primitive.material);
          if (!terrain) this.grow(corners);
        }
      }
    }
    return tiles;
  }

  private grow(corners: number[]): void {
    for (let k = 0; k < 9; ++k) {
      const axis = (k % 3) as 0 | 1 | 2;
      const value = corners[k] ?? 0;
      this.low[axis] = Math.min(this.low[axis], value);
      this.high[axis] = Math.max(this.high[axis], value);
    }
  }

  private addTile(tile: Tile, edged: boolean): void {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(tile.positions), 3));
    geometry.setAttribute('color', new BufferAttribute(new Uint8Array(tile.positions.length), 3, true));
    geometry.computeBoundingSphere();
    const mesh = new Mesh(geometry, kCityMaterial);
    mesh.userData['objects'] = Uint32Array.from(tile.objects);
    mesh.userData['light'] = lightOfTriangles(tile.positions);
    mesh.userData['materials'] = Uint16Array.from(tile.materials);
    mesh.matrixAutoUpdate = false;
    this.meshes.push(mesh);
    this.group.add(mesh);
    if (!edged) return;
    const edges = new LineSegments(new EdgesGeometry(geometry, 25), kEdgeMaterial);
    edges.matrixAutoUpdate = false;
    this.edges.push(edges);
    this.group.add(edges);
  }

  /** Recolours all surfaces. Facades are darker near the ground, as between buildings. */
  paint(by: 'height' | 'material', theme: Theme): void {
    const paint = kPaint[theme];
    const low = new Color(paint.lowRoof), high = new Color(paint.highRoof), ground = new Color(paint.ground);
    kEdgeMaterial.color.set(theme === 'dark' ? '#0B0F14' : '#6D7681');
    const ofObject = this.objects.map((o) =>
      o.surface === 'terrain' ? ground
        : o.surface === 'foliage' ? new Color(kMaterialColours['foliage'])
        : low.clone().lerp(high, Math.sqrt(Math.max(0, o.high_m - o.low_m) / this.highest)));
    const ofMaterial = this.materialNames.map((name) => new Color(kMaterialColours[name] ?? '#BDBDBD')
      .multiplyScalar(theme === 'dark' ? 0.6 : 1));
    for (const mesh of this.meshes) {
      const objects = mesh.userData['objects'] as Uint32Array;
      const materials = mesh.userData['materials'] as Uint16Array;
      const lights = mesh.userData['light'] as Float32Array;
      const position = mesh.geometry.getAttribute('position').array;
      const attribute = mesh.geometry.getAttribute('color') as BufferAttribute;
      const colours = attribute.array;
      for (let t = 0; t < objects.length; ++t) {
        const object = this.objects[objects[t] ?? 0];
        const terrain = object?.surface === 'terrain';
        const c = (by === 'material' && !terrain ? ofMaterial[materials[t] ?? 0] : ofObject[objects[t] ?? 0]) ?? ground;
        for (let k = 0; k < 3; ++k) {
          const at = 9 * t + 3 * k;
          const above = (position[at + 2] ?? 0) - (object?.low_m ?? 0);
          const shade = terrain ? 255 : 255 * (0.72 + 0.28 * Math.min(1, above / 40));
          colours[at] = Math.min(255, c.r * shade * (lights[3 * t] ?? 1));
          colours[at + 1] = Math.min(255, c.g * shade * (lights[3 * t + 1] ?? 1));
          colours[at + 2] = Math.min(255, c.b * shade * (lights[3 * t + 2] ?? 1));
        }
      }
      attribute.needsUpdate = true;
    }
  }

  /** The first object hit by a ray, and its distance; null for terrain and sky. */
  pick(ray: Raycaster): { object: number; distance: number } | null {
    const hit = this.hit(ray);
    if (!hit || hit.faceIndex === undefined || hit.faceIndex === null) return null;
    const object = (hit.object.userData['objects'] as Uint32Array)[hit.faceIndex] ?? null;
    return object !== null && this.objects[object]?.surface !== 'terrain' ? { object, distance: hit.distance } : null;
  }

  /** The first hit of a ray in the city. */
  hit(ray: Raycaster): Intersection | undefined {
    return ray.intersectObjects(this.meshes, false)[0];
  }

  /** Overlays a colour on one object. */
  show(object: number | null, colour: string): void {
    if (this.highlight) {
      this.group.remove(this.highlight);
      this.highlight.geometry.dispose();
      this.highlight = null;
    }
    if (object === null) return;
    const positions: number[] = [];
    for (const mesh of this.meshes) {
      const objects = mesh.userData['objects'] as Uint32Array;
      const position = mesh.geometry.getAttribute('position').array;
      objects.forEach((o, t) => {
        if (o === object) for (let k = 0; k < 9; ++k) positions.push(position[9 * t + k] ?? 0);
      });
    }
    // Only part of the light: the colour must also be visible on the dark side.
    const paint = new Color(colour);
    this.highlight = new Mesh(coloured(positions, lit(positions, () => paint, 0.5)), new MeshBasicMaterial({
      vertexColors: true, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1,
    }));
    this.group.add(this.highlight);
  }
}

const kCityMaterial = new MeshBasicMaterial({
  vertexColors: true, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
});
const kEdgeMaterial = new LineBasicMaterial({ color: '#6D7681', transparent: true, opacity: 0.55 });
