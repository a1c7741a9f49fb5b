// Over time: errors, satellites and DOP, C/N0 of the selection. A click or drag sets the time. And for the instant: the
// correlation function of the selected satellite.

import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import { type CorrelationFunction, correlationFunction } from './correlation';
import { kErrorColour, kFixColour, kPaint, pathColour, receiverColour, visibilityColour } from './palette';
import type { State } from './state';
import type { Store, Track } from './store';
import { onDrag } from './timeline';

export type ChartKind = 'error' | 'dop' | 'cn0' | 'ranges' | 'correlation';

interface Series {
  label: string;
  colour: string;
  values: ArrayLike<number>;
  width?: number;
}

interface Plotted {
  /** Seconds; for a correlation function metres. */
  x: ArrayLike<number>;
  unit: string;
  series: Series[];
  note?: string;
  /** For a correlation function: its paths, and the delay of the code loop [m]. */
  correlation?: { paths: CorrelationFunction['paths']; loop: number };
}

export class Chart {
  kind: ChartKind = 'error';
  private plot: uPlot | null = null;
  private shown: Plotted = { x: [], unit: '', series: [] };
  /** The line at the instant: a separate element, so that the curves need no redraw. */
  private readonly now = Object.assign(document.createElement('div'), { className: 'now' });

  /** @param run whether a receiver is of the run, and the chart's receiver of the run: an antenna that was put
   *  somewhere has only one instant */
  constructor(private readonly host: HTMLElement, private readonly store: Store, private readonly state: State,
              private readonly goTo: (seconds: number) => void,
              private readonly run: { receiver: () => number; has: (receiver: number) => boolean }) {
    new ResizeObserver(() => this.plot?.setSize(this.size())).observe(host);
    state.listen((change) => {
      const ofSatellite = this.kind === 'cn0' || this.kind === 'ranges' || this.kind === 'correlation';
      if (change === 'time' && this.kind !== 'correlation') this.showNow();
      else if (change === 'receiver' || change === 'look' || change === 'time') this.rebuild();
      else if ((change === 'selection' || change === 'data') && ofSatellite) this.rebuild();
    });
    this.rebuild();
  }

  private get track(): Track | undefined {
    return this.store.tracks[this.run.receiver()];
  }

  /** The line at the instant, and, while no mouse is over the chart, its values in the legend. In a correlation function: at the
   *  code loop. */
  private showNow(): void {
    if (!this.plot) return;
    const { over } = this.plot;
    const { correlation } = this.shown;
    this.now.hidden = correlation !== undefined && !Number.isFinite(correlation.loop);
    if (this.now.hidden) return;
    const x = Math.min(over.clientWidth, Math.max(0, this.plot.valToPos(correlation?.loop ?? this.state.time, 'x')));
    this.now.style.transform = `translateX(${x.toFixed(1)}px)`;
    if (!correlation && (this.plot.cursor.left ?? -1) < 0) this.plot.setLegend({ idx: this.track?.epochAt(this.state.time) ?? 0 }, false);
  }

  show(kind: ChartKind): void {
    this.kind = kind;
    this.rebuild();
  }

  private size(): { width: number; height: number } {
    return { width: Math.max(120, this.host.clientWidth), height: Math.max(60, this.host.clientHeight) };
  }

  private plotted(): Plotted {
    const { state, track } = this;
    if (!track) return { x: [], unit: '', series: [] };
    const column = (name: string): ArrayLike<number> => track.epochs.column(name);
    if (this.kind === 'dop') {
      return { x: track.time, unit: 'satellites, DOP', series: [
        { label: 'satellites used', colour: visibilityColour(1, state.theme), values: column('used') },
        { label: 'HDOP', colour: kErrorColour, values: column('hdop') },
        { label: 'VDOP', colour: kFixColour, values: column('vdop') },
      ] };
    }
    if (this.kind === 'cn0') return this.cn0();
    if (this.kind === 'ranges') return this.ranges();
    if (this.kind === 'correlation') return this.correlation();
    if (this.store.tracks.filter((_t, r) => this.run.has(r)).length > 1) return this.receivers();
    const up = Float64Array.from(column('error_up_m'), Math.abs);
    return { x: track.time, unit: 'm', series: [
      { label: 'vertical error', colour: kFixColour, values: up, width: 1 },
      { label: 'horizontal error', colour: kErrorColour, values: track.horizontal, width: 1.8 },
    ] };
  }

  /** Horizontal errors of all receivers, at the epochs of the receiver in the panels. */
  private receivers(): Plotted {
    const { state, store } = this;
    const chosen = this.run.receiver();
    const own = store.tracks[chosen];
    return { x: own?.time ?? [], unit: 'm', series: store.tracks.map((track, r) => ({
      label: `horizontal error, ${store.header.receivers[r]?.name ?? ''}`,
      colour: receiverColour(r, state.theme),
      values: r === chosen ? track.horizontal
        : Float64Array.from(own?.time ?? [], (t) => (track.size > 0 ? track.horizontal[track.epochAt(t)] ?? NaN : NaN)),
      width: r === chosen ? 2 : 1.2,
    })).filter((_s, r) => this.run.has(r)) };
  }

  /** Recorded and simulated pseudorange errors: of the selected satellite, else of all satellites of an epoch. */
  private ranges(): Plotted {
    const { state, store } = this;
    const pair = store.header.comparison;
    if (!pair || !store.comparison) return { x: [], unit: 'm', series: [], note: 'No recording in this view.' };
    const x = store.tracks[pair.recorded]?.time ?? [];
    const colours = [receiverColour(pair.recorded, state.theme), receiverColour(pair.simulated, state.theme)] as const;
    if (state.satellite !== null) {
      const id = store.header.satellites[state.satellite]?.id ?? '';
      const errors = (receiver: number): Float64Array => store.ofSatellite(receiver, state.satellite ?? -1, 'pseudorange_error_m');
      return { x, unit: 'm', series: [
        { label: `${id} pseudorange error, recorded`, colour: colours[0], values: errors(pair.recorded), width: 1.8 },
        { label: 'simulated', colour: colours[1], values: errors(pair.simulated), width: 1.8 },
      ] };
    }
    return { x, unit: 'm', series: [
      { label: 'pseudorange errors (rms), recorded', colour: colours[0], values: store.comparison.column('recorded_rms_m') },
      { label: 'simulated', colour: colours[1], values: store.comparison.column('simulated_rms_m') },
      { label: 'difference', colour: kPaint[state.theme].ink, values: store.comparison.column('difference_rms_m'), width: 1 },
    ] };
  }

  /** C/N0 of the selected satellite, in the loaded blocks. */
  private cn0(): Plotted {
    const { state, store, track } = this;
    if (state.satellite === null || !track) return { x: [], unit: 'dB-Hz', series: [], note: 'Select a satellite.' };
    const { satellite } = state;
    const values = (column: 'cn0_dbhz' | 'true_cn0_dbhz'): Float64Array => store.ofSatellite(this.run.receiver(), satellite, column);
    const id = store.header.satellites[state.satellite]?.id ?? '';
    return { x: track.time, unit: 'dB-Hz', series: [
      { label: `${id} true C/N0`, colour: kPaint[state.theme].faint, values: values('true_cn0_dbhz'), width: 1 },
      { label: `${id} stated C/N0`, colour: kPaint[state.theme].accent, values: values('cn0_dbhz'), width: 1.8 },
    ] };
  }

  /** Correlation function of the selected satellite at the instant. */
  private correlation(): Plotted {
    const { state, store } = this;
    const none = (note: string): Plotted => ({ x: [], unit: '', series: [], note });
    const { header } = store;
    const satellite = state.satellite === null ? undefined : header.satellites[state.satellite];
    if (!satellite) return none('Select a satellite.');
    const row = store.satellites(state.receiver, state.epoch).find((s) => s.satellite === state.satellite);
    if (!row) return none(`${satellite.id} is below the horizon at this time.`);
    const signal = header.words['signal']?.[row.signal];
    const code = header.codes?.find((c) => c.system === satellite.system && c.signal === signal);
    if (!code) return none('This view has no correlation functions: make it again with “canyon simulate --view”.');
    if (!row.paths.some((p) => Number.isFinite(p.loss_db))) {
      return none(header.receivers[state.receiver]?.strength === false
        ? 'This receiver has no signal model, so its paths have no strength.' : `Nothing arrives from ${satellite.id}.`);
    }
    const found = correlationFunction(row, code);
    const empty = found.delays.map(() => NaN);
    const words = header.words.path;
    const kinds = [...new Set(found.paths.map((p) => p.kind))].sort((a, b) => a - b);
    const counted = (kind: number): number => found.paths.filter((p) => p.kind === kind).length;
    const tracked = Number.isFinite(row.excess_m);
    return {
      x: found.delays, unit: 'of line of sight',
      series: [
        { label: `${satellite.id} ${signal}, all paths`, colour: kPaint[state.theme].ink, values: found.magnitudes, width: 2 },
        ...kinds.map((kind) => ({ label: `${counted(kind)} ${words[kind] ?? ''}`, colour: pathColour(kind, state.theme), values: empty })),
        { label: tracked ? `code loop at ${row.excess_m.toFixed(1)} m` : 'not tracked', colour: kPaint[state.theme].accent, values: empty },
      ],
      correlation: { paths: found.paths, loop: row.excess_m },
    };
  }

  private rebuild(): void {
    this.plot?.destroy();
    this.host.textContent = '';
    this.shown = this.plotted();
    const { x, unit, series, note, correlation } = this.shown;
    const of = correlation ? 'm' : 's';
    if (series.length === 0) {
      this.host.textContent = note ?? 'No time in this view.';
      this.plot = null;
      return;
    }
    const paint = kPaint[this.state.theme];
    const axis = { stroke: paint.faint, grid: { stroke: paint.rule, width: 1 }, ticks: { show: false }, font: '10px system-ui' };
    const clean = (values: ArrayLike<number>): (number | null)[] =>
      Array.from(values, (v) => (Number.isFinite(v) ? v : null));
    const options: uPlot.Options = {
      ...this.size(),
      padding: [8, 10, 0, 0],
      legend: { show: true, live: true },
      // Legend and buttons overlap the upper edge.
      scales: { x: { time: false }, y: { range: { min: { pad: 0.05, soft: 0, mode: 2 }, max: { pad: 0.3, soft: 0, mode: 2 } } } },
      cursor: { y: false, drag: { x: false, y: false }, points: { size: 5 } },
      axes: [
        { ...axis, size: 22, space: 90, values: (_u, splits) => splits.map((s) => `${s} ${of}`) },
        { ...axis, size: 46, label: unit, labelSize: 13, labelFont: '10px system-ui', labelGap: 0 },
      ],
      series: [
        { label: correlation ? 'detour' : 'time', value: (_u, v) => (v === null || v === undefined ? '–' : `${v.toFixed(1)} ${of}`) },
        ...series.map((s): uPlot.Series => ({
          label: s.label, stroke: s.colour, width: s.width ?? 1.5, points: { show: false }, spanGaps: false,
          value: (_u, v) => (v === null || v === undefined ? (correlation ? '' : '–') : v.toFixed(2)),
        })),
      ],
      // After uPlot's own first picture, which clears the legend.
      hooks: { drawClear: [(u) => (correlation ? this.drawPaths(u, correlation.paths) : this.drawLosses(u))], setSize: [() => this.showNow()], ready: [() => setTimeout(() => this.showNow())] },
    };
    this.plot = new uPlot(options, [clean(x), ...series.map((s) => clean(s.values))] as uPlot.AlignedData, this.host);
    this.plot.over.append(this.now);
    if (!correlation) onDrag(this.plot.over, (at) => this.plot && this.goTo(this.plot.posToVal(at, 'x')));
  }

  /** Behind the curve: each path at its excess delay, with its strength as height. */
  private drawPaths(u: uPlot, paths: CorrelationFunction['paths']): void {
    const foot = u.valToPos(0, 'y', true);
    u.ctx.save();
    u.ctx.lineWidth = 2 * devicePixelRatio;
    for (const path of paths) {
      const x = u.valToPos(path.delay, 'x', true);
      u.ctx.strokeStyle = pathColour(path.kind, this.state.theme);
      u.ctx.beginPath();
      u.ctx.moveTo(x, foot);
      u.ctx.lineTo(x, u.valToPos(path.magnitude, 'y', true));
      u.ctx.stroke();
    }
    u.ctx.restore();
  }

  /** Marks outages behind the curves. */
  private drawLosses(u: uPlot): void {
    const { left, top, width, height } = u.bbox;
    const x = (s: number): number => Math.min(left + width, Math.max(left, u.valToPos(s, 'x', true)));
    const { track } = this;
    if (!track) return;
    const interval = this.store.header.time?.interval_s ?? 0;
    u.ctx.save();
    u.ctx.fillStyle = 'rgba(213,94,0,0.22)';
    for (const [first, last] of track.losses()) {
      const from = x(track.time[first] ?? 0);
      u.ctx.fillRect(from, top, Math.max(1, x((track.time[last] ?? 0) + interval) - from), height);
    }
    u.ctx.restore();
  }
}
