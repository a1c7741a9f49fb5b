// The panel of a heat map: selection of its content, and its colour bar.

import { figure } from './colours';
import type { MapHeader } from './format';
import type { HeatMap } from './heatmap';
import { kPaint } from './palette';
import type { State } from './state';
import { fill, html } from './text';

export class MapPanel {
  private readonly bar: HTMLCanvasElement;
  private readonly probe: HTMLElement;
  private readonly low: HTMLInputElement;
  private readonly high: HTMLInputElement;
  private readonly colours: HTMLSelectElement;
  private readonly time: HTMLSelectElement;

  constructor(private readonly host: HTMLElement, map: MapHeader, private readonly heat: HeatMap, private readonly state: State) {
    fill(host, html`<p><span>heat map <b></b></span><label><input type="checkbox" id="map-on" checked> show</label></p>
      <select id="map-layer" aria-label="layer"></select>
      <div class="line"><select id="map-altitude" aria-label="altitude"></select></div>
      <div class="line"><button id="map-before" aria-label="time before" title="time before (,)">◂</button>
        <select id="map-time" aria-label="time of the map"></select>
        <button id="map-after" aria-label="time after" title="time after (.)">▸</button></div>
      <canvas id="map-bar" role="img" aria-label="colours of the map"></canvas>
      <div class="line"><label>from <input id="map-low" type="number" step="any"></label>
        <label>to <input id="map-high" type="number" step="any"></label><button id="map-reset" title="the layer's own colours and range">Reset</button></div>
      <div class="line"><label>colours <select id="map-colours"></select></label></div>
      <p id="map-probe"></p>`);
    const by = <T extends HTMLElement>(id: string): T => host.querySelector(`#${id}`) as T;
    (host.querySelector('b') as HTMLElement).textContent = map.name;
    this.bar = by('map-bar');
    this.probe = by('map-probe');
    this.low = by('map-low');
    this.high = by('map-high');
    this.colours = by('map-colours');
    this.time = by('map-time');
    const layer = by<HTMLSelectElement>('map-layer');
    map.layers.forEach((l, i) => layer.add(new Option(`${l.title}${l.unit ? ` [${l.unit}]` : ''}`, String(i), false, i === heat.layer)));
    layer.onchange = () => heat.select({ layer: Number(layer.value) });
    const altitude = by<HTMLSelectElement>('map-altitude');
    map.altitudes_m.forEach((_, i) => altitude.add(new Option(heat.altitudeText(i), String(i))));
    altitude.onchange = () => heat.select({ altitude: Number(altitude.value) });
    map.times_utc.forEach((_, i) => this.time.add(new Option(heat.timeText(i), String(i))));
    this.time.onchange = () => heat.select({ time: Number(this.time.value) });
    for (const [id, way] of [['map-before', -1], ['map-after', 1]] as const) {
      by(id).hidden = map.times_utc.length < 2;
      by(id).onclick = () => heat.step(way);
    }
    altitude.disabled = map.altitudes_m.length < 2;
    this.time.disabled = map.times_utc.length < 2;
    for (const name of Object.keys(map.colours)) this.colours.add(new Option(name, name));
    this.colours.onchange = () => heat.rescale({ colours: this.colours.value });
    this.low.onchange = this.high.onchange = () => this.range();
    by('map-reset').onclick = () => heat.reset();
    by<HTMLInputElement>('map-on').onchange = (e) => this.toggle((e.target as HTMLInputElement).checked);
    state.listen((change) => (change === 'map' || change === 'look') && this.update());
    this.read(null);
  }

  /** Shown or hidden, together with the panel's content. */
  toggle(on = !this.heat.mesh.visible): void {
    this.heat.mesh.visible = on;
    this.host.classList.toggle('off', !on);
    (this.host.querySelector('#map-on') as HTMLInputElement).checked = on;
    this.state.changed('map');
  }

  private range(): void {
    const { factor } = this.heat.chosen;
    const value = (box: HTMLInputElement): number => (box.value === '' ? NaN : Number(box.value) / factor);
    const [low, high] = [value(this.low), value(this.high)];
    const ordered = high > low;
    this.high.setCustomValidity(ordered ? '' : 'Give a range from a smaller number to a larger one.');
    if (ordered) this.heat.rescale({ low, high });
    else this.high.reportValidity();
  }

  update(): void {
    const { heat } = this;
    const { factor } = heat.chosen;
    this.high.setCustomValidity('');
    this.low.value = String(+(heat.scale.low * factor).toPrecision(6));
    this.high.value = String(+(heat.scale.high * factor).toPrecision(6));
    this.colours.value = heat.scale.colours;
    this.time.value = String(heat.time);
    this.drawBar();
  }

  private drawBar(): void {
    const scale = devicePixelRatio || 1;
    const width = this.host.clientWidth - 22 || 200;
    this.bar.width = width * scale;
    this.bar.height = 30 * scale;
    this.bar.style.width = `${width}px`;
    const c = this.bar.getContext('2d', { willReadFrequently: true });
    if (!c) return;
    c.scale(scale, scale);
    const colours = this.heat.barColours(128);
    colours.forEach(([r, g, b], i) => {
      c.fillStyle = `rgb(${r} ${g} ${b})`;
      const from = Math.floor((i * width) / colours.length);
      c.fillRect(from, 0, width - from, 13);  // the next one covers its own part
    });
    c.fillStyle = kPaint[this.state.theme].ink;
    c.font = '10px system-ui, "DejaVu Sans", sans-serif';
    c.textBaseline = 'top';
    for (const t of [0, 0.5, 1]) {
      c.textAlign = t === 0 ? 'left' : t === 1 ? 'right' : 'center';
      const text = figure(this.heat.barValue(t), this.heat.chosen.decimals);
      c.fillText(t === 1 && this.heat.chosen.unit ? `${text} ${this.heat.chosen.unit}` : text, t * width, 17);
    }
  }

  /** The probe's text for a cell, or its usage. */
  read(cell: { column: number; row: number } | null): void {
    this.probe.textContent = cell ? this.heat.text(cell.column, cell.row) : 'point at a cell to read it; click for all layers';
    this.probe.classList.toggle('hint', !cell);
  }
}
