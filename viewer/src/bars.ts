// C/N0 of each satellite at the instant: the value reported by the receiver as a bar, the true one as a tick.

import { Canvas, kFont } from './canvas';
import { kPaint, visibilityColour } from './palette';
import type { State } from './state';
import type { SatelliteRow, Store } from './store';

const kLow = 10;
const kHigh = 55;

export class SignalBars {
  private readonly canvas: Canvas;
  private rows: SatelliteRow[] = [];
  private step = 0;
  private left = 0;

  constructor(host: HTMLElement, private readonly store: Store, private readonly state: State) {
    this.canvas = new Canvas(host, 'C/N0 of each satellite in dB-Hz', (c, w, h) => this.draw(c, w, h));
    this.canvas.element.addEventListener('click', (e) => {
      const x = e.clientX - this.canvas.element.getBoundingClientRect().left - this.left;
      state.selectSatellite(this.rows[Math.floor(x / this.step)]?.satellite ?? null);
    });
    state.listen((change) => change !== 'playing' && change !== 'camera' && this.canvas.update());
  }

  private draw(c: CanvasRenderingContext2D, w: number, h: number): void {
    const { state, store } = this;
    const paint = kPaint[state.theme];
    this.left = 26;
    const bottom = h - 26;
    const top = 6;
    this.rows = store.satellites(state.receiver, state.epoch, false);
    c.font = `10px ${kFont}`;
    if (store.header.receivers[state.receiver]?.strength === false) {
      c.fillStyle = paint.faint;
      c.textAlign = 'center';
      c.fillText('This receiver’s signals have no strength (signal: {enabled: false}).', w / 2, h / 2);
      return;
    }
    const y = (cn0: number): number => bottom - ((bottom - top) * (Math.min(kHigh, Math.max(kLow, cn0)) - kLow)) / (kHigh - kLow);
    c.textAlign = 'right';
    c.textBaseline = 'middle';
    for (const cn0 of [10, 25, 40, 55]) {
      c.strokeStyle = paint.rule;
      c.lineWidth = 1;
      c.beginPath();
      c.moveTo(this.left, y(cn0));
      c.lineTo(w, y(cn0));
      c.stroke();
      c.fillStyle = paint.faint;
      c.fillText(`${cn0}`, this.left - 5, Math.max(7, y(cn0)));
    }
    this.step = (w - this.left) / Math.max(1, this.rows.length);
    const width = Math.min(18, this.step * 0.72);
    this.rows.forEach((row, i) => {
      const x = this.left + (i + 0.5) * this.step;
      if (row.satellite === state.satellite) {
        c.fillStyle = paint.rule;
        c.fillRect(x - this.step / 2, 0, this.step, h);
      }
      c.fillStyle = c.strokeStyle = visibilityColour(row.visibility, state.theme);
      if (!Number.isNaN(row.cn0_dbhz)) {
        const height = bottom - y(row.cn0_dbhz);
        c.globalAlpha = row.used ? 1 : 0.35;
        c.fillRect(x - width / 2, bottom - height, width, height);
        c.globalAlpha = 1;
        c.lineWidth = 1.2;
        c.strokeRect(x - width / 2, bottom - height, width, height);
      }
      if (!Number.isNaN(row.true_cn0_dbhz)) {
        c.strokeStyle = paint.ink;
        c.lineWidth = 1.5;
        c.beginPath();
        c.moveTo(x - width / 2 - 2, y(row.true_cn0_dbhz));
        c.lineTo(x + width / 2 + 2, y(row.true_cn0_dbhz));
        c.stroke();
      }
      c.save();
      c.translate(x + 3, bottom + 4);
      c.rotate(-Math.PI / 2);
      c.fillStyle = paint.ink;
      c.textAlign = 'right';
      c.font = `9px ${kFont}`;
      c.textBaseline = 'alphabetic';
      c.fillText(store.header.satellites[row.satellite]?.id ?? '?', 0, 0);
      c.restore();
    });
  }
}
