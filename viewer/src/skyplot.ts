// The sky over the antenna: zenith in the middle, horizon outside, north up; parts hidden by buildings are grey.

import { Canvas, kFont } from './canvas';
import { outline } from './lines';
import { kPaint, kVisibilityShapes, visibilityColour } from './palette';
import type { State } from './state';
import type { Store } from './store';

interface Spot {
  satellite: number;
  x: number;
  y: number;
}

export class SkyPlot {
  private readonly canvas: Canvas;
  private spots: Spot[] = [];

  constructor(host: HTMLElement, private readonly store: Store, private readonly state: State) {
    this.canvas = new Canvas(host, 'sky plot: satellites by azimuth and elevation, with the skyline of buildings',
      (c, w, h) => this.draw(c, w, h));
    this.canvas.element.addEventListener('click', (e) => {
      const box = this.canvas.element.getBoundingClientRect();
      const near = this.spots
        .map((s) => ({ s, d: Math.hypot(s.x - (e.clientX - box.left), s.y - (e.clientY - box.top)) }))
        .sort((a, b) => a.d - b.d)[0];
      state.selectSatellite(near && near.d < 16 ? near.s.satellite : null);
    });
    state.listen((change) => change !== 'playing' && change !== 'camera' && this.canvas.update());
  }

  private draw(c: CanvasRenderingContext2D, w: number, h: number): void {
    const paint = kPaint[this.state.theme];
    const cx = w / 2;
    const cy = h / 2;
    const r = Math.max(4, Math.min(w, h) / 2 - 17);
    const on = (azimuth: number, elevation: number): [number, number] => {
      const d = (r * (90 - elevation)) / 90;
      const a = (azimuth * Math.PI) / 180;
      return [cx + d * Math.sin(a), cy - d * Math.cos(a)];
    };
    this.skyline(c, paint.skyline, r, cx, cy, on);
    c.strokeStyle = paint.rule;
    c.lineWidth = 1;
    for (const elevation of [0, 30, 60]) {
      c.beginPath();
      c.arc(cx, cy, (r * (90 - elevation)) / 90, 0, 2 * Math.PI);
      c.stroke();
    }
    c.beginPath();
    for (const a of [0, 45, 90, 135]) {
      c.moveTo(...on(a, 0));
      c.lineTo(...on(a + 180, 0));
    }
    c.stroke();
    const mask = this.store.header.receivers[this.state.receiver]?.elevation_mask_deg ?? 0;
    if (mask > 0) {
      c.setLineDash([3, 3]);
      c.strokeStyle = paint.faint;
      c.beginPath();
      c.arc(cx, cy, (r * (90 - mask)) / 90, 0, 2 * Math.PI);
      c.stroke();
      c.setLineDash([]);
    }
    c.fillStyle = paint.faint;
    c.font = `600 11px ${kFont}`;
    c.textAlign = 'center';
    c.textBaseline = 'middle';
    for (const [name, a] of [['N', 0], ['E', 90], ['S', 180], ['W', 270]] as const) c.fillText(name, ...on(a, -8));
    c.font = `10px ${kFont}`;
    c.fillText('30°', ...on(22.5, 30));
    c.fillText('60°', ...on(22.5, 60));
    this.satellites(c, on);
  }

  private skyline(c: CanvasRenderingContext2D, colour: string, r: number, cx: number, cy: number,
                  on: (a: number, e: number) => [number, number]): void {
    const skyline = this.store.tracks[this.state.receiver]?.skyline(this.state.epoch) ?? new Float64Array();
    if (skyline.length === 0) return;
    const step = 360 / skyline.length;
    c.fillStyle = colour;
    c.beginPath();
    c.arc(cx, cy, r, 0, 2 * Math.PI);
    // In the opposite direction of the circle, so that the open middle is cut out.
    for (let k = skyline.length - 1; k >= 0; --k) {
      const e = skyline[k] ?? 0;
      const to = on((k + 1) * step, e);
      if (k === skyline.length - 1) c.moveTo(...to);
      else c.lineTo(...to);
      c.lineTo(...on(k * step, e));
    }
    c.closePath();
    c.fill('evenodd');
  }

  private satellites(c: CanvasRenderingContext2D, on: (a: number, e: number) => [number, number]): void {
    const paint = kPaint[this.state.theme];
    this.spots = [];
    for (const row of this.store.satellites(this.state.receiver, this.state.epoch, false)) {
      const [x, y] = on(row.azimuth_deg, row.elevation_deg);
      this.spots.push({ satellite: row.satellite, x, y });
      const colour = visibilityColour(row.visibility, this.state.theme);
      mark(c, row.visibility, x, y, 6, colour, row.used ? paint.ink : paint.panel);
      if (row.satellite === this.state.satellite) {
        c.strokeStyle = paint.accent;
        c.lineWidth = 2.5;
        c.beginPath();
        c.arc(x, y, 10.5, 0, 2 * Math.PI);
        c.stroke();
      }
    }
    c.fillStyle = paint.ink;
    c.font = `10px ${kFont}`;
    c.textAlign = 'center';
    c.textBaseline = 'middle';
    const taken = this.spots.map(({ x, y }): Spot => ({ satellite: -1, x, y }));
    for (const { satellite, x, y } of this.spots) {
      const free = labelPlace(x, y, taken);
      taken.push({ satellite, ...free });
      c.fillText(this.store.header.satellites[satellite]?.id ?? '?', free.x, free.y);
    }
  }
}

/** Centre of a label: above its mark, else the position with the least overlap of marks and labels. */
function labelPlace(x: number, y: number, taken: Spot[]): { x: number; y: number } {
  const covered = (place: { x: number; y: number }): number => taken.filter((t) => {
    const label = t.satellite >= 0;
    return Math.abs(t.x - place.x) < (label ? 21 : 15) && Math.abs(t.y - place.y) < (label ? 10 : 9);
  }).length;
  const places = [[0, -13], [0, 13], [18, 0], [-18, 0], [16, -11], [-16, -11]].map(([dx = 0, dy = 0]) => ({ x: x + dx, y: y + dy }));
  return places.reduce((best, place) => (covered(place) < covered(best) ? place : best));
}

/** Kinds differ in shape and colour. */
export function mark(c: CanvasRenderingContext2D, visibility: number, x: number, y: number, r: number, fill: string,
                     edge: string): void {
  const side = 2.4 * r;
  c.save();
  c.fillStyle = fill;
  c.strokeStyle = edge;
  c.lineWidth = 1.3;
  c.translate(x - side / 2, y - side / 2);
  outline(c, kVisibilityShapes[visibility] ?? 'cross', side);
  c.fill();
  c.stroke();
  c.restore();
}
