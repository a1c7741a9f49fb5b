// Lines of a width in pixels and marks of a size in pixels; each is drawn once in front of buildings and once, thin and
// faint, through them, so that paths behind a facade stay visible.

import {
  BufferAttribute, BufferGeometry, CanvasTexture, Color, Group, LineBasicMaterial, LineDashedMaterial, LineSegments, Points, PointsMaterial,
} from 'three';
import type { Shape } from './palette';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import { LineSegments2 } from 'three/examples/jsm/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/examples/jsm/lines/LineSegmentsGeometry.js';

/** Width [pixels] up to which lines are drawn with minimum width. */
const kThin = 1.1;

/** More pieces than this are drawn thin, for any width: without a graphics processor they would take seconds. */
const kMostWide = 3000;

/** Corners of triangles, ends of lines or points, three numbers each, with one colour each. */
export function coloured(positions: readonly number[], colours: ArrayLike<number>): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(positions), 3));
  geometry.setAttribute('color', new BufferAttribute(Float32Array.from(colours), 3));
  return geometry;
}

/** Points with their colours; finish() shows those added since clear(). */
abstract class Collected {
  protected positions: number[] = [];
  protected colours: number[] = [];
  private readonly colour = new Color();

  clear(): void {
    this.positions = [];
    this.colours = [];
  }
  protected put(at: readonly number[], colour: string): void {
    const { r, g, b } = this.colour.set(colour);
    this.positions.push(at[0] ?? 0, at[1] ?? 0, at[2] ?? 0);
    this.colours.push(r, g, b);
  }
  abstract finish(): void;
}

export class Segments extends Collected {
  readonly group = new Group();
  private readonly wide: LineMaterial;
  private readonly thin: LineBasicMaterial;
  /** The part behind objects. Thin, since wide lines would cost as much as all those in front. */
  private readonly behind: LineBasicMaterial | null;

  /** @param through opacity behind objects; 0: hidden; 1: drawn over everything */
  constructor(private readonly width: number, opacity: number, through: number, dashed = false) {
    super();
    const common = { opacity, vertexColors: true, transparent: true, depthWrite: false, depthTest: through < 1 };
    const dashes = { dashSize: 5, gapSize: 5 };
    const thin = (more: object): LineBasicMaterial =>
      (dashed ? new LineDashedMaterial({ ...common, ...dashes, ...more }) : new LineBasicMaterial({ ...common, ...more }));
    this.wide = new LineMaterial({ ...common, ...dashes, linewidth: width, dashed });
    this.thin = thin({});
    this.behind = through > 0 && through < 1 ? thin({ opacity: through, depthTest: false }) : null;
  }

  add(from: readonly number[], to: readonly number[], colour: string): void {
    this.put(from, colour);
    this.put(to, colour);
  }
  finish(): void {
    for (const child of [...this.group.children]) {
      (child as LineSegments2 | LineSegments).geometry.dispose();
      this.group.remove(child);
    }
    if (this.positions.length === 0) return;
    const geometry = coloured(this.positions, this.colours);
    // One-pixel lines use the graphics library's lines: less work than strips of triangles.
    const thin = this.width <= kThin || this.positions.length > 6 * kMostWide;
    const lines = [thin ? new LineSegments(geometry, this.thin) : this.wideLines()];
    if (this.behind) lines.push(new LineSegments(geometry, this.behind));
    for (const line of lines) {
      if (this.wide.dashed) line.computeLineDistances();
      line.frustumCulled = false;
      line.renderOrder = 2;
      this.group.add(line);
    }
  }

  private wideLines(): LineSegments2 {
    const geometry = new LineSegmentsGeometry();
    geometry.setPositions(this.positions);
    geometry.setColors(this.colours);
    return new LineSegments2(geometry, this.wide);
  }
}

/** Outline of a shape within a square of this side. */
export function outline(c: CanvasRenderingContext2D, shape: Shape, side: number): void {
  const low = 0.08 * side;
  const high = 0.92 * side;
  const middle = side / 2;
  c.beginPath();
  if (shape === 'disc') c.arc(middle, middle, middle - low, 0, 2 * Math.PI);
  else if (shape === 'square') c.rect(low * 1.7, low * 1.7, high - low * 2.4, high - low * 2.4);
  else {
    const a = 0.16 * side;  // of an arm's end, along the square's side
    const corners = shape === 'cross' ? [[low, low + a], [middle - a, middle], [low, high - a], [low + a, high], [middle, middle + a], [high - a, high],
      [high, high - a], [middle + a, middle], [high, low + a], [high - a, low], [middle, middle - a], [low + a, low]]
      : shape === 'diamond' ? [[middle, low], [high, middle], [middle, high], [low, middle]]
      : [[middle, low], [high, high], [low, high]];
    for (const [x, y] of corners) c.lineTo(x ?? 0, y ?? 0);
    c.closePath();
  }
}

const textures = new Map<Shape, CanvasTexture>();
function texture(shape: Shape): CanvasTexture {
  const known = textures.get(shape);
  if (known) return known;
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 64;
  const c = canvas.getContext('2d', { willReadFrequently: true });  // without waiting for a graphics processor
  if (c) {
    c.fillStyle = '#fff';
    c.strokeStyle = 'rgba(0,0,0,0.85)';
    c.lineWidth = 5;
    outline(c, shape, 64);
    c.fill();
    c.stroke();
  }
  const made = new CanvasTexture(canvas);
  textures.set(shape, made);
  return made;
}

export class Marks extends Collected {
  readonly points: Points;

  constructor(size: number, shape: Shape = 'disc') {
    super();
    this.points = new Points(new BufferGeometry(), new PointsMaterial({
      size, sizeAttenuation: false, vertexColors: true, map: texture(shape), alphaTest: 0.3, transparent: true, depthTest: false,
      depthWrite: false,
    }));
    this.points.frustumCulled = false;
    this.points.renderOrder = 3;
  }
  add(at: readonly number[], colour: string): void {
    this.put(at, colour);
  }
  finish(): void {
    this.points.geometry.dispose();
    this.points.geometry = coloured(this.positions, this.colours);
    this.points.visible = this.positions.length > 0;
  }
}
