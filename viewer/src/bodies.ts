// Bodies near the antenna at an instant that are not in the map: vehicles, signs, awnings, crowns of trees, a host's moving models;
// and an arrow for the vehicle with the antenna.

import { BufferGeometry, Color, DoubleSide, IcosahedronGeometry, Mesh, MeshBasicMaterial, type Raycaster } from 'three';
import { lit } from './light';
import { coloured } from './lines';
import { kMaterialColours, kPaint, type Theme } from './palette';
import type { Place } from './tracks';
import type { BodyRow } from './store';

const kRadians = Math.PI / 180;
/** Corners of a box's 12 triangles: bit 0 ahead, 1 left, 2 up. */
const kBox = [0, 1, 3, 0, 3, 2, 4, 7, 5, 4, 6, 7, 0, 5, 1, 0, 4, 5, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3];
const kCrown = new IcosahedronGeometry(1, 1).getAttribute('position').array;
const kNames: Record<string, string> = { vehicle: 'Vehicle', structure: 'Sign, awning or footbridge', crown: 'Crown of a tree' };
/** An arrow: nose, left, right, notch, top; ahead, left, up [m]. As long as a car. */
const kArrow = [[2.6, 0, 0], [-1.9, 1.3, 0], [-1.9, -1.3, 0], [-1.1, 0, 0], [-1, 0, 0.8]] as const;
const kArrowFaces = [0, 1, 4, 0, 4, 2, 1, 3, 4, 3, 2, 4, 0, 3, 1, 0, 2, 3];

function described({ length_m: length, width_m: width, low_m: low, high_m: high }: BodyRow, word: string): string {
  const size = word === 'crown' ? `${width.toFixed(1)} m across` : `${length.toFixed(1)} m long, ${width.toFixed(1)} m wide`;
  return `${kNames[word] ?? word}: ${size}, from ${low.toFixed(1)} to ${high.toFixed(1)} m (up)`;
}

export class Bodies {
  readonly mesh = new Mesh(new BufferGeometry(), new MeshBasicMaterial({ vertexColors: true, side: DoubleSide }));
  private positions: number[] = [];
  private colours: Color[] = [];  // of each triangle
  private owners: ({ body: BodyRow; word: string } | null)[] = [];  // of each triangle; null: the arrow

  constructor() {
    this.mesh.frustumCulled = false;
  }

  clear(): void {
    this.positions = [];
    this.colours = [];
    this.owners = [];
  }

  /** @param word its kind */
  add(body: BodyRow, word: string, theme: Theme): void {
    const { east_m: east, north_m: north, low_m: low, high_m: high } = body;
    const colour = new Color(word === 'crown' ? kMaterialColours['foliage'] : word === 'structure' ? kPaint[theme].structure : kPaint[theme].vehicle);
    if (word === 'crown') {
      const [middle, half] = [(low + high) / 2, (high - low) / 2];
      for (let i = 0; i < kCrown.length; i += 3) {
        this.positions.push(east + (body.width_m / 2) * (kCrown[i] ?? 0), north + (body.width_m / 2) * (kCrown[i + 1] ?? 0),
          middle + half * (kCrown[i + 2] ?? 0));
      }
      return this.paint(colour, { body, word });
    }
    const [c, s] = [Math.cos(body.yaw_deg * kRadians), Math.sin(body.yaw_deg * kRadians)];
    for (const corner of kBox) {
      const ahead = (corner & 1 ? 0.5 : -0.5) * body.length_m;
      const left = (corner & 2 ? 0.5 : -0.5) * body.width_m;
      this.positions.push(east + c * ahead - s * left, north + s * ahead + c * left, corner & 4 ? high : low);
    }
    this.paint(colour, { body, word });
  }

  /** The vehicle's arrow. Angles [deg]: yaw from east counter-clockwise, roll left side up, pitch nose up. */
  arrow(at: Place, yaw: number, roll: number, pitch: number, colour: string): void {
    const [cy, sy] = [Math.cos(yaw * kRadians), Math.sin(yaw * kRadians)];
    const [cp, sp] = [Math.cos(pitch * kRadians), Math.sin(pitch * kRadians)];
    const [cr, sr] = [Math.cos(roll * kRadians), Math.sin(roll * kRadians)];
    const nose = [cy * cp, sy * cp, sp];
    const side = [-sy, cy, 0];
    const top = [-cy * sp, -sy * sp, cp];
    for (const corner of kArrowFaces) {
      const [ahead, left, up] = kArrow[corner] ?? kArrow[0];
      for (let k = 0; k < 3; ++k) {
        const leftwards = (side[k] ?? 0) * cr + (top[k] ?? 0) * sr;
        const upwards = (top[k] ?? 0) * cr - (side[k] ?? 0) * sr;
        this.positions.push((at[k] ?? 0) + ahead * (nose[k] ?? 0) + left * leftwards + up * upwards);
      }
    }
    this.paint(new Color(colour), null);
  }

  private paint(colour: Color, owner: { body: BodyRow; word: string } | null): void {
    while (this.colours.length < this.positions.length / 9) {
      this.colours.push(colour);
      this.owners.push(owner);
    }
  }

  /** The first body hit by a ray. */
  pick(ray: Raycaster): { what: string; distance: number } | null {
    const hit = ray.intersectObject(this.mesh, false)[0];
    if (!hit) return null;
    const owner = this.owners[hit.faceIndex ?? -1];
    return { what: owner ? described(owner.body, owner.word) : 'The vehicle that carries the antenna', distance: hit.distance };
  }

  /** Shows the bodies added since clear(). */
  finish(): void {
    this.mesh.geometry.dispose();
    this.mesh.geometry = coloured(this.positions, lit(this.positions, (triangle) => this.colours[triangle] ?? new Color(), 0.35));
    this.mesh.visible = this.positions.length > 0;
  }
}
