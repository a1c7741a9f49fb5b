// A heat map over the city: its cells as a picture at their computed height, a panel to select layer,
// altitude, time and colours, and a probe that reads the cell under the pointer.

import {
  BufferAttribute, BufferGeometry, DataTexture, DoubleSide, Mesh, MeshBasicMaterial, NearestFilter, SRGBColorSpace, type Ray, Vector3,
} from 'three';
import { colourAt, figure, position, rgb, valueAt, type Rgb, type Scale } from './colours';
import type { MapHeader, MapLayer, Rows } from './format';
import type { State } from './state';
import type { Store } from './store';
import { html, type Html } from './text';

/** Vertices of the picture across: hills are smoother than cells. */
const kMostVertices = 257;
/** A computed cell without a value: no fix, or nothing received. */
const kNoValue: Rgb = [128, 128, 128];

export class HeatMap {
  readonly mesh: Mesh;
  layer = 0;
  altitude = 0;
  time = 0;
  readonly scales: Scale[];
  private readonly bars: Record<string, Rgb[]>;
  private cells: Rows | null = null;
  private values: Rows | null = null;
  private texture: DataTexture | null = null;
  private builtAltitude = -1;
  private asked = 0;

  constructor(private readonly store: Store, private readonly map: MapHeader, private readonly state: State) {
    this.bars = Object.fromEntries(Object.entries(map.colours).map(([name, list]) => [name, list.map(rgb)]));
    this.scales = map.layers.map(({ low, high, colours }) => ({ low, high, colours }));
    // The errors of fixes are the most common layer.
    this.layer = Math.max(0, map.layers.findIndex((l) => l.name === 'horizontal_error'));
    this.mesh = new Mesh(new BufferGeometry(), new MeshBasicMaterial({
      transparent: true, opacity: 0.82, side: DoubleSide, depthWrite: false, toneMapped: false, alphaTest: 0.01, polygonOffset: true,
      polygonOffsetFactor: -1, polygonOffsetUnits: -4,
    }));
    this.mesh.renderOrder = 1;
    this.mesh.matrixAutoUpdate = false;
  }

  get chosen(): MapLayer {
    return this.map.layers[this.layer] as MapLayer;
  }
  get scale(): Scale {
    return this.scales[this.layer] as Scale;
  }

  /** Loads and shows the selected layer. */
  async show(): Promise<void> {
    const ask = ++this.asked;
    const { altitude, time } = this;
    const [cells, values] = await Promise.all([this.store.mapCells(altitude), this.store.mapValues(altitude, time)]);
    if (ask !== this.asked) return;  // the selection changed meanwhile
    this.cells = cells;
    this.values = values;
    if (this.builtAltitude !== altitude) this.build();
    this.builtAltitude = altitude;
    this.colour();
  }

  private up(column: number, row: number): number {
    return this.cells?.at('up_m', row * this.map.grid.columns + column) ?? NaN;
  }

  /** A sheet over all cells, at their heights; flat if they are. */
  private build(): void {
    const { west_m, south_m, spacing_m, columns, rows } = this.map.grid;
    const heights = this.cells?.column('up_m') ?? [];
    let low = Infinity;
    let high = -Infinity;
    for (const h of heights) {
      low = Math.min(low, h);
      high = Math.max(high, h);
    }
    const flat = !(high - low > 0.05);
    const across = flat ? 2 : Math.min(kMostVertices, columns + 1);
    const along = flat ? 2 : Math.min(kMostVertices, rows + 1);
    const positions = new Float32Array(3 * across * along);
    const uv = new Float32Array(2 * across * along);
    for (let j = 0; j < along; ++j) {
      for (let i = 0; i < across; ++i) {
        const x = (i / (across - 1)) * columns;
        const y = (j / (along - 1)) * rows;
        const h = flat ? low : this.up(Math.min(columns - 1, Math.floor(x)), Math.min(rows - 1, Math.floor(y)));
        const at = j * across + i;
        positions.set([west_m + x * spacing_m, south_m + y * spacing_m, Number.isFinite(h) ? h : Number.isFinite(low) ? low : 0], 3 * at);
        uv.set([i / (across - 1), j / (along - 1)], 2 * at);
      }
    }
    const index: number[] = [];
    for (let j = 0; j + 1 < along; ++j) {
      for (let i = 0; i + 1 < across; ++i) {
        const a = j * across + i;
        index.push(a, a + 1, a + across + 1, a, a + across + 1, a + across);
      }
    }
    this.mesh.geometry.dispose();
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(positions, 3));
    geometry.setAttribute('uv', new BufferAttribute(uv, 2));
    geometry.setIndex(index);
    geometry.computeBoundingSphere();
    this.mesh.geometry = geometry;
  }

  private colour(): void {
    const { columns, rows } = this.map.grid;
    const count = columns * rows;
    const bytes = new Uint8Array(4 * count);
    const bar = this.bars[this.scale.colours] ?? [];
    const states = this.cells?.column('state') ?? [];
    const values = this.values?.column('value').subarray(this.layer * count, (this.layer + 1) * count) ?? [];
    for (let i = 0; i < count; ++i) {
      if (states[i] !== 0) continue;  // clear: there is no cell
      const value = values[i] ?? NaN;
      const c = Number.isNaN(value) ? kNoValue : colourAt(this.chosen, bar, position(this.chosen, this.scale, value));
      bytes[4 * i] = c[0];
      bytes[4 * i + 1] = c[1];
      bytes[4 * i + 2] = c[2];
      bytes[4 * i + 3] = 255;
    }
    this.texture?.dispose();
    this.texture = new DataTexture(bytes, columns, rows);
    this.texture.colorSpace = SRGBColorSpace;
    this.texture.magFilter = this.texture.minFilter = NearestFilter;
    this.texture.needsUpdate = true;
    const material = this.mesh.material as MeshBasicMaterial;
    material.map = this.texture;
    material.needsUpdate = true;
  }

  /** The colours of the bar from its low end to its high end. */
  barColours(steps: number): Rgb[] {
    const bar = this.bars[this.scale.colours] ?? [];
    return Array.from({ length: steps }, (_, i) => colourAt(this.chosen, bar, (i + 0.5) / steps));
  }
  /** The value in the layer's unit at a position of the bar. */
  barValue(t: number): number {
    return valueAt(this.chosen, this.scale, t) * this.chosen.factor;
  }

  /** The cell hit by a ray, and its distance; null outside the map. */
  hit(ray: Ray): { column: number; row: number; distance: number } | null {
    if (!this.cells || !this.mesh.visible || Math.abs(ray.direction.z) < 1e-6) return null;
    const { west_m, south_m, spacing_m, columns, rows } = this.map.grid;
    let z = this.mesh.geometry.boundingSphere?.center.z ?? 0;
    const place = new Vector3();
    // Heights of streets change slowly: iterates a few times with the height of the previous cell.
    for (let step = 0; step < 8; ++step) {
      const distance = (z - ray.origin.z) / ray.direction.z;
      if (distance <= 0) return null;
      ray.at(distance, place);
      const column = Math.floor((place.x - west_m) / spacing_m);
      const row = Math.floor((place.y - south_m) / spacing_m);
      const clamped = this.up(Math.min(columns - 1, Math.max(0, column)), Math.min(rows - 1, Math.max(0, row)));
      if (!Number.isFinite(clamped) || Math.abs(clamped - z) < 0.02 || step === 7) {
        return column >= 0 && row >= 0 && column < columns && row < rows ? { column, row, distance } : null;
      }
      z = clamped;
    }
    return null;
  }

  /** Centre of a cell, east north up. */
  centre(column: number, row: number): [number, number, number] {
    const { west_m, south_m, spacing_m } = this.map.grid;
    return [west_m + (column + 0.5) * spacing_m, south_m + (row + 0.5) * spacing_m, this.up(column, row)];
  }
  /** The ground below a cell's antenna, and its height above it [m]; for altitudes above the ellipsoid the ground is unknown, and this is 0. */
  footOf(column: number, row: number): { foot: [number, number, number]; height: number } {
    const [east, north, up] = this.centre(column, row);
    const height = this.map.altitude_above === 'terrain' ? this.map.altitudes_m[this.altitude] ?? 0 : 0;
    return { foot: [east, north, up - height], height };
  }
  get spacing(): number {
    return this.map.grid.spacing_m;
  }

  /** A cell's text of a layer: "7.38 m", "no value", "inside a building". */
  text(column: number, row: number, layer = this.layer): string {
    const { columns, rows } = this.map.grid;
    const cell = row * columns + column;
    const state = this.cells?.at('state', cell) ?? 0;
    if (state !== 0) return this.map.states[state] ?? '?';
    const value = this.values?.at('value', layer * columns * rows + cell) ?? NaN;
    const about = this.map.layers[layer];
    if (!about || Number.isNaN(value)) return 'no value (no fix, or nothing received)';
    return `${figure(value * about.factor, about.decimals)}${about.unit ? ` ${about.unit}` : ''}`;
  }

  /** All layers at a cell, for the panel of the selection. */
  cellHtml(column: number, row: number): Html {
    const [east, north, up] = this.centre(column, row);
    const shown = (m: number): string => m.toFixed(1);
    return html`<h3>cell <small>east ${shown(east)} m, north ${shown(north)} m, up ${Number.isFinite(up) ? shown(up) : '–'} m</small></h3>
      <dl class="pairs">${this.map.layers.map((l, k) =>
        html`<dt>${l.title}</dt><dd data-layer="${l.name}">${this.text(column, row, k)}</dd>`)}</dl>
      ${Number.isFinite(up) ? html`<p><button data-put>Put antenna here</button></p>` : ''}
      <p class="hint">${this.where}; cells of ${this.map.grid.spacing_m} m</p>`;
  }

  /** "15 m above the terrain, 2019-04-28 12:58:03 UTC" */
  get where(): string {
    return `${this.altitudeText(this.altitude)}, ${this.timeText(this.time)}`;
  }
  altitudeText(i: number): string {
    return `${this.map.altitudes_m[i] ?? '?'} m above the ${this.map.altitude_above}`;
  }
  timeText(i: number): string {
    return `${(this.map.times_utc[i] ?? '?').slice(0, 19).replace('T', ' ')} UTC`;
  }

  select(change: { layer?: number; altitude?: number; time?: number }): void {
    Object.assign(this, change);
    void this.show().then(() => this.state.changed('map'));
  }
  rescale(change: Partial<Scale>): void {
    Object.assign(this.scale, change);
    this.colour();
    this.state.changed('map');
  }
  /** The layer's own colours and range. */
  reset(): void {
    const { low, high, colours } = this.chosen;
    this.rescale({ low, high, colours });
  }
  step(way: number): void {
    const count = this.map.times_utc.length;
    this.select({ time: (this.time + way + count) % count });
  }
}
