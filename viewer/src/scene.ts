// The three-dimensional view. East is x, north y, up z: the city's frame.

import {
  BufferAttribute, BufferGeometry, Color, DoubleSide, Fog, Mesh, MeshBasicMaterial, PlaneGeometry, Raycaster, Scene, Vector2, Vector3, WebGLRenderer,
} from 'three';
import { Bodies } from './bodies';
import { CameraControl } from './camera';
import { CityMesh } from './city';
import type { Rows } from './format';
import type { HeatMap } from './heatmap';
import { light } from './light';
import { Marks, Segments } from './lines';
import { kErrorColour, kindColour, kPaint, kShapes, kVisibilityShapes, receiverColour, receiverShape, visibilityColour, type Shape } from './palette';
import type { State } from './state';
import type { SatelliteRow, Store, Track } from './store';
import { together, Tracks, type Place } from './tracks';

const kRadians = Math.PI / 180;

/** Unit vector, east north up, of an azimuth from north clockwise and an elevation [deg]. */
export function direction(azimuth: number, elevation: number): Place {
  const a = azimuth * kRadians;
  const e = elevation * kRadians;
  return [Math.sin(a) * Math.cos(e), Math.cos(a) * Math.cos(e), Math.sin(e)];
}

/** Half axes [m] and angle from east counter-clockwise [rad] of the ellipse that holds 95 % of a plane normal
 *  distribution with this covariance [m^2] (chi-square with 2 degrees of freedom: 5.991). */
export function ellipse95(ee: number, nn: number, en: number): { major: number; minor: number; angle: number } {
  const mean = (ee + nn) / 2;
  const d = Math.hypot((ee - nn) / 2, en);
  return {
    major: Math.sqrt(5.991 * (mean + d)),
    minor: Math.sqrt(5.991 * Math.max(0, mean - d)),
    angle: 0.5 * Math.atan2(2 * en, ee - nn),
  };
}

/** Without a graphics processor, successive pictures have this fraction of the screen's pixels per side ... */
const kCoarse = 0.5;
/** ... and a sharp picture follows after this number of frames without a change. */
const kRest = 8;

/** Distance of an antenna put on a wall from the wall [m]. */
const kBeforeWall = 0.5;

interface Label {
  element: HTMLElement;
  place: Vector3;
}

export class SceneView {
  readonly control: CameraControl;
  readonly city: CityMesh;
  /** Milliseconds for the last pictures, newest last. */
  readonly frameTimes: number[] = [];
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly ground: Mesh;
  private readonly strong = new Segments(2, 0.95, 0.22);
  private readonly weak = new Segments(1, 0.55, 0.12);
  private readonly chosen = new Segments(4, 1, 0.35);
  private readonly blocked = new Segments(1.2, 0.6, 0.25, true);
  private readonly dome = new Segments(1, 0.35, 0);
  private readonly trails = new Segments(2, 0.7, 0.25);
  private readonly error = new Segments(3, 1, 1);
  private readonly points = new Marks(7);
  private readonly satellites = kVisibilityShapes.map((shape) => new Marks(12, shape));
  private readonly antenna = new Marks(13);
  private readonly fixMarks = Object.fromEntries(kShapes.map((shape) => [shape, new Marks(12, shape)])) as Record<Shape, Marks>;
  private readonly ellipse: Mesh;
  private readonly cellMark = new Segments(2.5, 1, 0.5);
  private readonly tracks: Tracks;
  private readonly bodies = new Bodies();
  private readonly labels = new Map<string, Label>();
  private wanted = true;
  private readonly software: boolean;
  private coarse = false;
  /** Frames since the last change. */
  private rested = kRest;

  constructor(
    private readonly host: HTMLElement,
    private readonly overlay: HTMLElement,
    glb: ArrayBuffer,
    private readonly store: Store,
    private readonly state: State,
  ) {
    // Without a graphics processor smooth edges cost more than all the rest, and making a test context takes half a
    // second: the first one is reused.
    let context = newContext(false);
    this.software = drawsInSoftware(context);
    if (!this.software) {
      context.getExtension('WEBGL_lose_context')?.loseContext();
      context = newContext(true);
    }
    this.renderer = new WebGLRenderer({ canvas: context.canvas, context });
    this.sharpen();
    host.prepend(this.renderer.domElement);
    this.renderer.domElement.setAttribute('aria-label', 'three-dimensional view of the city');
    this.city = new CityMesh(glb, store.header.city.objects);
    this.scene.add(this.city.group);
    const [lowX, lowY, lowZ] = this.city.low;
    const [highX, highY] = this.city.high;
    const known = Number.isFinite(lowX);
    const span = known ? Math.max(highX - lowX, highY - lowY) : 500;
    // Below everything: an open field, or land around a city.
    this.ground = new Mesh(new PlaneGeometry(40 * span, 40 * span), new MeshBasicMaterial());
    // Behind all occluding objects.
    this.ground.renderOrder = 1;
    this.ground.position.set(known ? (lowX + highX) / 2 : 0, known ? (lowY + highY) / 2 : 0, (known ? lowZ : 0) - 0.6);
    this.scene.add(this.ground);
    this.ellipse = new Mesh(new BufferGeometry(), new MeshBasicMaterial({
      transparent: true, opacity: 0.16, side: DoubleSide, depthTest: false, depthWrite: false,
    }));
    this.ellipse.frustumCulled = false;
    this.scene.add(this.ellipse);
    for (const s of [this.dome, this.trails, this.weak, this.strong, this.blocked, this.chosen, this.error,
      this.cellMark]) this.scene.add(s.group);
    this.tracks = new Tracks(store, state);
    this.scene.add(this.tracks.group, this.bodies.mesh);
    for (const m of this.marks) this.scene.add(m.points);
    this.control = new CameraControl(this.renderer.domElement, () => this.request(), (x, y, shift) => this.pick(x, y, shift));
    this.control.target.set(this.ground.position.x, this.ground.position.y, 0);
    this.control.distance = store.tracks.length > 0 || store.header.live ? 2.1 * this.radius : 1.1 * span;
    new ResizeObserver(() => this.resize()).observe(host);
    this.resize();
    state.listen((change) => {
      if (change === 'camera') this.control.setMode(state.camera);
      if (change === 'look') this.paint();
      if (change === 'data' || change === 'receiver' || change === 'look' || change === 'layers') this.drawTracks();
      if (change === 'selection') this.city.show(state.object, kPaint[state.theme].accent);
      if (change === 'selection' || change === 'map') this.markCell();
      if (change === 'map') this.request();
      else if (change !== 'playing') this.update();
    });
    this.paint();
    this.drawTracks();
    this.update();
  }

  /** For measurements: calls and triangles of the last picture. */
  get drawn(): { calls: number; triangles: number } {
    const { calls, triangles } = this.renderer.info.render;
    return { calls, triangles };
  }
  /** For tests: drawn fixes, by their shapes. */
  get fixMarksShown(): Record<string, number> {
    return Object.fromEntries(Object.entries(this.fixMarks).map(([shape, marks]) => [shape, marks.points.geometry.getAttribute('position').count]));
  }

  private get marks(): Marks[] {
    return [this.points, ...this.satellites, this.antenna, ...Object.values(this.fixMarks)];
  }

  /** Radius of the dome [m]: above the buildings near the antenna, but not dominating. */
  get radius(): number {
    const height = Number.isFinite(this.city.high[2]) ? this.city.high[2] - this.city.low[2] : 0;
    return Math.min(600, Math.max(180, 1.3 * height));
  }

  request(): void {
    this.wanted = true;
  }

  /** West, south, east, north [m] of the camera's view, within the city. */
  groundBox(): [number, number, number, number] {
    const { target: { x, y }, distance } = this.control;
    const half = Math.min(distance / 2, 1000);
    const [west, south, east, north] = [x - half, y - half, x + half, y + half];
    const { low, high } = this.city;
    if (!Number.isFinite(low[0])) return [west, south, east, north];
    return [Math.max(west, low[0]), Math.max(south, low[1]), Math.min(east, high[0]), Math.min(north, high[1])];
  }

  /** Draws a picture if something changed; true if it did. */
  frame(): boolean {
    if (!this.wanted && ++this.rested === kRest && this.coarse) this.sharpen();
    if (!this.wanted) return false;
    if (this.software && !this.coarse && this.rested < kRest) {
      this.coarse = true;
      this.renderer.setPixelRatio(kCoarse);
    }
    this.wanted = false;
    this.rested = 0;
    const begin = performance.now();
    const { clientWidth, clientHeight } = this.host;
    this.control.apply(clientWidth / Math.max(1, clientHeight));
    this.renderer.render(this.scene, this.control.camera);
    // With software drawing the call returns early: reading a pixel waits for its end.
    if (this.measuring) {
      const gl = this.renderer.getContext();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    }
    this.placeLabels(clientWidth, clientHeight);
    this.frameTimes.push(performance.now() - begin);
    if (this.frameTimes.length > 240) this.frameTimes.shift();
    return true;
  }
  measuring = false;

  /** The next picture has full resolution. */
  sharpen(): void {
    this.coarse = false;
    this.rested = kRest;
    this.renderer.setPixelRatio(this.software ? 1 : Math.min(2, devicePixelRatio));
    this.request();
  }

  private resize(): void {
    this.renderer.setSize(this.host.clientWidth, this.host.clientHeight);
    this.request();
  }

  private paint(): void {
    const paint = kPaint[this.state.theme];
    this.scene.background = new Color(paint.sky);
    this.scene.fog = new Fog(paint.sky, 1500, 9000);
    (this.ground.material as MeshBasicMaterial).color.set(paint.ground).multiply(light(0, 0, 1, new Color()));
    this.city.paint(this.state.colour, this.state.theme);
    this.city.show(this.state.object, paint.accent);
    this.request();
  }

  /** Takes clicks with Shift, and all while `putting`: a place on the ground or on a building. */
  onPut: ((place: Place) => void) | null = null;
  putting = false;
  /** Takes clicks on bodies, with their names. */
  onBody: ((what: string) => void) | null = null;

  private pick(x: number, y: number, shift: boolean): void {
    // With the present camera: its last picture may be older.
    this.control.apply(this.host.clientWidth / Math.max(1, this.host.clientHeight));
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2(x, y), this.control.camera);
    if (this.onPut && (shift || this.putting)) {
      // The ground drawn below everything is 0.6 m below the city's.
      const below = ray.intersectObject(this.ground, false)[0]?.point.clone().setZ(this.ground.position.z + 0.6);
      const hit = this.city.hit(ray);
      const point = hit?.point ?? below;
      // In front of a wall, not in it.
      const normal = hit?.face?.normal;
      if (point && normal && Math.abs(normal.z) < 0.5) {
        point.addScaledVector(normal, normal.dot(ray.ray.direction) < 0 ? kBeforeWall : -kBeforeWall);
      }
      if (point) this.onPut([point.x, point.y, point.z]);
      return;
    }
    const object = this.city.pick(ray);
    const body = this.bodies.pick(ray);
    if (body && !(object && object.distance < body.distance)) return this.onBody?.(body.what);
    const cell = this.heat?.hit(ray.ray);
    if (cell && !(object && object.distance < cell.distance)) this.state.selectCell(cell);
    else this.state.selectObject(object?.object ?? null);
  }

  private heat: HeatMap | null = null;
  /** Overlays a heat map on the city. @param read gets the cell under the pointer, null: none */
  showMap(heat: HeatMap, read: (cell: { column: number; row: number } | null) => void): void {
    this.heat = heat;
    this.scene.add(heat.mesh);
    const canvas = this.renderer.domElement;
    canvas.addEventListener('pointermove', (e) => {
      if (e.buttons !== 0) return;
      const box = canvas.getBoundingClientRect();
      const ray = new Raycaster();
      const x = ((e.clientX - box.left) / box.width) * 2 - 1;
      ray.setFromCamera(new Vector2(x, 1 - ((e.clientY - box.top) / box.height) * 2), this.control.camera);
      const cell = heat.hit(ray.ray);
      // Points behind a building cannot be selected.
      const hidden = cell && (this.city.pick(ray)?.distance ?? Infinity) < cell.distance;
      read(hidden ? null : cell);
    });
    canvas.addEventListener('pointerleave', () => read(null));
  }

  private markCell(): void {
    this.cellMark.clear();
    const { cell, theme } = this.state;
    if (cell && this.heat?.mesh.visible) {
      const [x, y, up] = this.heat.centre(cell.column, cell.row);
      const half = Math.max(0.5, this.heat.spacing / 2);
      const z = (Number.isFinite(up) ? up : 0) + 0.05;
      const corners: Place[] = [[x - half, y - half, z], [x + half, y - half, z], [x + half, y + half, z], [x - half, y + half, z]];
      corners.forEach((c, i) => this.cellMark.add(c, corners[(i + 1) % 4] ?? c, kPaint[theme].accent));
    }
    this.cellMark.finish();
    this.request();
  }

  private drawTracks(): void {
    this.tracks.draw();
    this.request();
  }

  /** Draws everything for an instant. */
  update(): void {
    const { state, store } = this;
    const track = store.tracks[state.receiver];
    for (const s of [this.strong, this.weak, this.chosen, this.blocked, this.dome, this.trails, this.error]) s.clear();
    for (const m of this.marks) m.clear();
    this.bodies.clear();
    this.ellipse.visible = false;
    const labels = new Set<string>();
    if (track && track.size > 0) {
      const i = state.epoch;
      const at: Place = [track.east[i] ?? 0, track.north[i] ?? 0, track.up[i] ?? 0];
      this.control.moveVehicle(new Vector3(...at), 90 - track.epochs.at('yaw_deg', i));
      this.antenna.add(at, this.state.theme === 'dark' ? '#FFFFFF' : '#20262C');
      const rows = store.satellites(state.receiver, i);
      if (state.layers.bodies) this.drawBodies(at, track);
      if (state.layers.dome) this.drawDome(at, rows, labels);
      for (const row of rows) this.drawPaths(at, row);
      if (state.layers.fix) store.tracks.forEach((_, receiver) => this.drawFix(receiver));
    }
    this.tracks.group.visible = state.layers.tracks;
    for (const s of [this.strong, this.weak, this.chosen, this.blocked, this.dome, this.trails, this.error]) s.finish();
    for (const m of this.marks) m.finish();
    this.bodies.finish();
    for (const [key, label] of this.labels) {
      if (labels.has(key)) continue;
      label.element.remove();
      this.labels.delete(key);
    }
    this.request();
  }

  private drawBodies(at: Place, track: Track): void {
    const { state, store } = this;
    const words = store.header.words.body ?? [];
    for (const body of store.bodies(state.receiver, state.epoch)) this.bodies.add(body, words[body.kind] ?? '', state.theme);
    const angle = (name: string): number => track.epochs.at(name, state.epoch);
    // Not visible from the antenna.
    if (state.camera !== 'first') this.bodies.arrow(at, angle('yaw_deg'), angle('roll_deg'), angle('pitch_deg'), kPaint[state.theme].truth);
  }

  private drawDome(at: Place, rows: SatelliteRow[], labels: Set<string>): void {
    const r = this.radius;
    const paint = kPaint[this.state.theme];
    const on = (azimuth: number, elevation: number): Place => shifted(at, direction(azimuth, elevation), r);
    for (const elevation of [0, 30, 60]) {
      for (let a = 0; a < 360; a += 5) this.dome.add(on(a, elevation), on(a + 5, elevation), paint.faint);
    }
    for (let a = 0; a < 360; a += 45) {
      for (let e = 0; e < 90; e += 10) this.dome.add(on(a, e), on(a, e + 10), paint.faint);
    }
    for (const [name, a] of [['N', 0], ['E', 90], ['S', 180], ['W', 270]] as const) {
      this.label(`compass-${name}`, name, 'compass', on(a, 0), labels);
    }
    for (const row of rows) {
      const colour = visibilityColour(row.visibility, this.state.theme);
      const place = on(row.azimuth_deg, row.elevation_deg);
      this.satellites[row.visibility]?.add(place, colour);
      const id = this.store.header.satellites[row.satellite]?.id ?? '?';
      const chosen = row.satellite === this.state.satellite;
      const label = this.label(`satellite-${row.satellite}`, id, 'satellite', place, labels);
      label.style.setProperty('--colour', colour);
      label.classList.toggle('chosen', chosen);
      label.classList.toggle('unused', !row.used);
      label.onclick = () => this.state.selectSatellite(row.satellite);
    }
    this.drawTrails(at, rows);
  }

  /** Earlier directions of satellites, in loaded blocks: one point of each block. */
  private drawTrails(at: Place, rows: SatelliteRow[]): void {
    const last = new Map(rows.map((r) => [r.satellite, [r.azimuth_deg, r.elevation_deg] as [number, number]]));
    const blocks = this.store.loadedBlocks(this.state.receiver).filter((b) => b.entry.first_epoch <= this.state.epoch);
    for (const block of blocks.reverse().slice(0, 120)) {
      const [begin, end] = block.range(block.entry.first_epoch);
      for (let k = begin; k < end; ++k) {
        const row = block.row(k, false);
        const next = last.get(row.satellite);
        if (!next) continue;
        this.trails.add(shifted(at, direction(row.azimuth_deg, row.elevation_deg), this.radius),
          shifted(at, direction(...next), this.radius), visibilityColour(row.visibility, this.state.theme));
        last.set(row.satellite, [row.azimuth_deg, row.elevation_deg]);
      }
    }
  }

  private drawPaths(at: Place, row: SatelliteRow): void {
    const chosen = row.satellite === this.state.satellite;
    if (this.state.satellite !== null && !chosen) return;  // only the selected satellite's paths are shown
    const colour = visibilityColour(row.visibility, this.state.theme);
    const towards = direction(row.azimuth_deg, row.elevation_deg);
    if (row.visibility === 3) {
      if (this.state.layers.blocked || chosen) this.blocked.add(at, shifted(at, towards, this.radius), colour);
    } else if (!this.state.layers.rays && !chosen) {
      return;
    }
    for (const path of row.paths) {
      // Scattered and weak paths are thin: a facade's cluster would hide the rest.
      const thin = path.kind === 3 || path.loss_db > 20;
      if (row.visibility === 3 && !chosen) continue;
      const lines = chosen ? (thin ? this.strong : this.chosen) : thin ? this.weak : this.strong;
      let from: Place = at;
      for (const corner of [path.point, path.far]) {
        if (!corner) continue;
        lines.add(from, corner, colour);
        if (this.state.layers.points && (!thin || chosen)) this.points.add(corner, colour);
        from = corner;
      }
      // The last legs of echoes all point to the satellite; at full length, those of twenty satellites would hide the city.
      const whole = chosen || from === at;
      lines.add(from, shifted(from, towards, whole ? reach(at, from, towards, this.radius) : 0.2 * this.radius), colour);
    }
  }

  private drawFix(receiver: number): void {
    const track = this.store.tracks[receiver];
    const chosen = receiver === this.state.receiver;
    if (!track || track.size === 0 || (!chosen && !this.state.layers.others)) return;
    const i = track.epochAt(this.state.time);
    const at: Place = [track.east[i] ?? 0, track.north[i] ?? 0, track.up[i] ?? 0];
    const colour = receiverColour(receiver, this.state.theme);
    const own = this.store.tracks[this.state.receiver];
    if (!chosen && own && !together(track, own)) this.antenna.add(at, colour);
    if (!track.fixed(i)) return;
    const e = track.epochs;
    const fix: Place = [e.at('fix_east_m', i), e.at('fix_north_m', i), e.at('fix_up_m', i)];
    this.error.add(at, fix, this.store.tracks.length > 1 ? colour : kErrorColour);
    this.fixMarks[receiverShape(receiver)].add(fix, colour);
    if (chosen) this.drawEllipse(fix, e, i, colour);
    if (!chosen || !e.has('baseline_east_m')) return;
    // The vector from its base, in the colour of its kind.
    const base: Place = [fix[0] - e.at('baseline_east_m', i), fix[1] - e.at('baseline_north_m', i), fix[2] - e.at('baseline_up_m', i)];
    if (base.every(Number.isFinite)) this.error.add(fix, base, kindColour(this.store.kind(receiver, i)));
  }

  private drawEllipse(fix: Place, e: Rows, i: number, colour: string): void {
    if (!Number.isFinite(e.at('covariance_east_m2', i))) return;
    (this.ellipse.material as MeshBasicMaterial).color.set(colour);
    const { major, minor, angle } = ellipse95(e.at('covariance_east_m2', i), e.at('covariance_north_m2', i),
      e.at('covariance_east_north_m2', i));
    // From inside, it would tint everything.
    (this.ellipse.material as MeshBasicMaterial).opacity = 0.16 * Math.min(1, this.control.distance / (3 * major));
    const positions: number[] = [];
    const on = (turn: number): Place => [
      fix[0] + major * Math.cos(turn) * Math.cos(angle) - minor * Math.sin(turn) * Math.sin(angle),
      fix[1] + major * Math.cos(turn) * Math.sin(angle) + minor * Math.sin(turn) * Math.cos(angle),
      fix[2],
    ];
    for (let k = 0; k < 64; ++k) {
      const a = on((k * Math.PI) / 32);
      const b = on(((k + 1) * Math.PI) / 32);
      positions.push(...fix, ...a, ...b);
      this.error.add(a, b, colour);
    }
    this.ellipse.geometry.dispose();
    this.ellipse.geometry = new BufferGeometry();
    this.ellipse.geometry.setAttribute('position', new BufferAttribute(new Float32Array(positions), 3));
    this.ellipse.visible = true;
  }

  private label(key: string, text: string, kind: string, place: Place, used: Set<string>): HTMLElement {
    used.add(key);
    let label = this.labels.get(key);
    if (!label) {
      const element = document.createElement(kind === 'satellite' ? 'button' : 'span');
      element.className = `label ${kind}`;
      element.textContent = text;
      if (kind === 'satellite') element.title = `select satellite ${text}`;
      this.overlay.append(element);
      label = { element, place: new Vector3() };
      this.labels.set(key, label);
    }
    label.place.set(...place);
    return label.element;
  }

  private placeLabels(width: number, height: number): void {
    const p = new Vector3();
    for (const { element, place } of this.labels.values()) {
      p.copy(place).project(this.control.camera);
      const seen = p.z < 1 && Math.abs(p.x) < 1.02 && Math.abs(p.y) < 1.02;
      element.style.display = seen ? '' : 'none';
      if (seen) element.style.transform = `translate(${((p.x + 1) / 2) * width}px, ${((1 - p.y) / 2) * height}px)`;
    }
  }
}

function newContext(antialias: boolean): WebGL2RenderingContext {
  const context = document.createElement('canvas').getContext('webgl2', { antialias });
  if (!context) throw new Error('This browser has no WebGL 2, which is required to draw the city.');
  return context;
}

/** Whether WebGL runs on the processor: SwiftShader, llvmpipe, Microsoft's Basic Render Driver. */
function drawsInSoftware(gl: WebGL2RenderingContext): boolean {
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  return info !== null && /swiftshader|llvmpipe|software|basic render/i.test(String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)));
}

function shifted(from: Place, direction: Place, metres: number): Place {
  return [from[0] + metres * direction[0], from[1] + metres * direction[1], from[2] + metres * direction[2]];
}

/** Distance from a point in a direction to the sphere around `centre`; at least a tenth of its radius. */
function reach(centre: Place, from: Place, towards: Place, radius: number): number {
  const d = [from[0] - centre[0], from[1] - centre[1], from[2] - centre[2]] as const;
  const b = d[0] * towards[0] + d[1] * towards[1] + d[2] * towards[2];
  const c = d[0] ** 2 + d[1] ** 2 + d[2] ** 2 - radius ** 2;
  const root = b * b - c;
  return Math.max(radius / 10, root > 0 ? -b + Math.sqrt(root) : 0);
}
