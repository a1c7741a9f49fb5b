// The time bar: the run's instant, its outages and its faults.

import { Canvas, kFont } from './canvas';
import { kErrorColour, kPaint } from './palette';
import type { State } from './state';
import type { Store } from './store';

const kMargin = 8;

/** Clicks on an element and drags along it, with the position from its left edge [px]. */
export function onDrag(element: HTMLElement, to: (x: number) => void): void {
  const go = (e: PointerEvent): void => to(e.clientX - element.getBoundingClientRect().left);
  element.addEventListener('pointerdown', (e) => {
    if (e.button !== 0) return;
    element.setPointerCapture(e.pointerId);
    go(e);
  });
  element.addEventListener('pointermove', (e) => {
    if (element.hasPointerCapture(e.pointerId)) go(e);
  });
}

export class Timeline {
  private readonly canvas: Canvas;

  constructor(private readonly host: HTMLElement, private readonly store: Store, private readonly state: State,
              goTo: (seconds: number) => void) {
    this.canvas = new Canvas(host, 'time line', (c, w, h) => this.draw(c, w, h));
    host.setAttribute('role', 'slider');
    host.setAttribute('aria-label', 'time');
    host.tabIndex = 0;
    onDrag(host, (x) => {
      const share = (x - kMargin) / Math.max(1, host.clientWidth - 2 * kMargin);
      const [from, to] = store.span;
      goTo(from + Math.min(1, Math.max(0, share)) * (to - from));
    });
    state.listen((change) => {
      if (change === 'time' || change === 'receiver' || change === 'look') this.update();
    });
    this.update();
  }

  private update(): void {
    const [from, to] = this.store.span;
    this.host.setAttribute('aria-valuemin', from.toFixed(1));
    this.host.setAttribute('aria-valuemax', to.toFixed(1));
    this.host.setAttribute('aria-valuenow', this.state.time.toFixed(1));
    this.canvas.update();
  }

  private draw(c: CanvasRenderingContext2D, w: number, h: number): void {
    const paint = kPaint[this.state.theme];
    const track = this.store.tracks[this.state.receiver];
    const [from, to] = this.store.span;
    const x = (s: number): number => kMargin + ((w - 2 * kMargin) * (s - from)) / (to - from);
    const y = h / 2 - 4;
    c.fillStyle = paint.rule;
    c.fillRect(kMargin, y, w - 2 * kMargin, 8);
    c.fillStyle = paint.accent;
    c.globalAlpha = 0.45;
    c.fillRect(kMargin, y, x(this.state.time) - kMargin, 8);
    c.globalAlpha = 1;
    if (track) {
      const interval = this.store.header.time?.interval_s ?? 0;
      c.fillStyle = kErrorColour;
      for (const [first, last] of track.losses()) {
        const left = x(track.time[first] ?? 0);
        c.fillRect(left, y, Math.max(1.5, Math.min(w - kMargin, x((track.time[last] ?? 0) + interval)) - left), 8);
      }
    }
    this.drawFaults(c, x, y, paint.ink);
    this.drawStreets(c, x, y, paint.faint);
    c.fillStyle = paint.accent;
    c.strokeStyle = paint.panel;
    c.lineWidth = 2;
    c.beginPath();
    c.arc(x(this.state.time), h / 2, 8, 0, 2 * Math.PI);
    c.fill();
    c.stroke();
  }

  /** Beginnings of a validation's streets, with their lengths if they fit. */
  private drawStreets(c: CanvasRenderingContext2D, x: (s: number) => number, y: number, ink: string): void {
    c.fillStyle = ink;
    c.font = `9px ${kFont}`;
    for (const street of this.store.header.comparison?.streets ?? []) {
      c.fillRect(x(street.from_s), y - 9, 1, 8);
      const text = `${street.length_m.toFixed(0)} m`;
      if (c.measureText(text).width + 6 < x(street.until_s) - x(street.from_s)) c.fillText(text, x(street.from_s) + 3, y - 3);
    }
  }

  /** Brackets under the bar, each with its name. */
  private drawFaults(c: CanvasRenderingContext2D, x: (s: number) => number, y: number, ink: string): void {
    c.strokeStyle = c.fillStyle = ink;
    c.lineWidth = 1.5;
    c.font = `9px ${kFont}`;
    c.textBaseline = 'alphabetic';
    for (const f of this.store.header.receivers[this.state.receiver]?.faults ?? []) {
      const left = x(f.from_s);
      const right = Math.max(left + 2, x(f.until_s));
      c.beginPath();
      c.moveTo(left, y + 14);
      c.lineTo(left, y + 11);
      c.lineTo(right, y + 11);
      c.lineTo(right, y + 14);
      c.stroke();
      c.fillText(f.name, left + 3, y + 21);
    }
  }
}
