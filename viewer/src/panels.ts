// Panels of text: metrics of the instant, table of satellites, selection, summary of the run.

import { kVisibilityShapes, visibilityColour } from './palette';
import type { State } from './state';
import type { Store } from './store';
import { clock, fill, fixed, html, kMissing, type Html } from './text';

/** Words of the files, shortened for a narrow table; the full word is in the tooltip. */
const kShort: Record<string, string> = { 'LOS+multipath': 'LOS+mp', tracking: 'track', searching: 'search', holding: 'hold' };
const shortened = (word: string | undefined): Html =>
  html`<span title="${word ?? ''}">${kShort[word ?? ''] ?? word ?? ''}</span>`;

export class Readout {
  constructor(private readonly host: HTMLElement, private readonly store: Store, private readonly state: State) {
    state.listen((change) => (change === 'time' || change === 'receiver') && this.update());
    this.update();
  }

  private update(): void {
    const { store, state } = this;
    const track = store.tracks[state.receiver];
    if (!track || !store.header.time) {
      this.host.replaceChildren();
      return;
    }
    const i = state.epoch;
    const e = track.epochs;
    const status = store.header.words.status[track.status[i] ?? 0] ?? '';
    const place = store.header.words.placement[e.at('placement', i)] ?? '';
    const item = (name: string, label: string, value: number, decimals: number, unit: string): Html =>
      html`<div><dt>${label}</dt><dd data-name="${name}" data-raw="${value}">${fixed(value, decimals)}${unit ? html`<small> ${unit}</small>` : ''}</dd></div>`;
    const kind = store.header.words.fix_kind?.[e.at('fix_kind', i)];
    const faults = store.faults(state.receiver, i);
    const { name } = store.header.receivers[state.receiver] ?? {};
    fill(this.host, html`
      ${store.tracks.length > 1 ? html`<p class="name">${name ?? ''}</p>` : ''}
      <p><b class="${track.fixed(i) ? 'good' : 'bad'}" data-name="status">${track.fixed(i) ? `fix${kind && kind !== 'single' ? `: ${kind}` : ''}` : `no fix: ${place === 'unknown' ? 'the antenna’s position is unknown' : status}`}</b>
        <span data-name="clock">${clock(store.header.time.begin_utc, track.time[i] ?? 0)}</span> UTC
        ${place !== 'free' && track.fixed(i) ? html`<b class="bad">${place}</b>` : ''}
        ${faults ? html`<b class="bad" data-name="faults">${faults}</b>` : ''}</p>
      <dl>
        ${item('horizontal', 'horizontal error', track.horizontal[i] ?? NaN, 2, 'm')}
        ${item('error_east_m', 'east', e.at('error_east_m', i), 2, 'm')}
        ${item('error_north_m', 'north', e.at('error_north_m', i), 2, 'm')}
        ${item('error_up_m', 'up', e.at('error_up_m', i), 2, 'm')}
        ${item('used', 'used', e.at('used', i), 0, '')}
        ${item('tracked', 'tracked', e.at('tracked', i), 0, '')}
        ${item('hdop', 'HDOP', e.at('hdop', i), 2, '')}
        ${item('pdop', 'PDOP', e.at('pdop', i), 2, '')}
        ${item('speed', 'speed', Math.hypot(e.at('velocity_east_mps', i), e.at('velocity_north_mps', i)), 1, 'm/s')}
      </dl>`);
  }
}

/** All columns of the view at the instant. */
export class EpochTable {
  constructor(private readonly host: HTMLElement, private readonly store: Store, private readonly state: State) {
    state.listen((change) => (change === 'time' || change === 'receiver') && this.update());
    new MutationObserver(() => this.update()).observe(host, { attributeFilter: ['hidden'] });
  }

  private update(): void {
    const { store, state } = this;
    const rows = store.tracks[state.receiver]?.epochs;
    if (this.host.hidden || !rows) return;
    const columns = store.header.tables.find((t) => t.name === 'epochs')?.columns ?? [];
    fill(this.host, html`<dl class="pairs">${columns.filter((c) => rows.has(c.name)).map((c) => {
      const value = rows.at(c.name, state.epoch);
      const word = store.header.words[c.name]?.[value];
      return html`<dt title="${c.about ?? ''}">${c.name}</dt><dd data-name="${c.name}" data-raw="${value}">${
        word !== undefined ? word || kMissing : Number.isFinite(value) ? `${Number(value.toPrecision(9))} ${c.unit}` : kMissing}</dd>`;
    })}</dl>`);
  }
}

export class SatelliteTable {
  private readonly body: HTMLTableSectionElement;

  constructor(host: HTMLElement, private readonly store: Store, private readonly state: State) {
    fill(host, html`<table class="satellites"><thead><tr>
      <th>sat</th><th title="elevation [deg]">el °</th><th title="azimuth from north, clockwise [deg]">az °</th>
      <th class="word">signal</th><th title="C/N0 reported by the receiver [dB-Hz]">C/N0</th><th class="word">lock</th>
      <th title="used in the fix; x: excluded by it">fix</th><th title="code delay by the signal paths [m]">excess m</th>
      <th title="error of the pseudorange [m]">error m</th><th title="residual of the fix [m]">res. m</th>
      </tr></thead><tbody></tbody></table>`);
    this.body = host.querySelector('tbody') as HTMLTableSectionElement;
    this.body.addEventListener('click', (e) => {
      const row = (e.target as Element).closest('tr');
      if (row?.dataset['satellite']) state.selectSatellite(Number(row.dataset['satellite']));
    });
    state.listen((change) => change !== 'playing' && change !== 'camera' && this.update());
    this.update();
  }

  private update(): void {
    const { store, state } = this;
    const words = store.header.words;
    const row = this.body.contains(document.activeElement) ? document.activeElement?.closest('tr') : null;
    const focused = row?.dataset['satellite'];
    fill(this.body, html`${store.satellites(state.receiver, state.epoch, false).map((s) => html`
      <tr data-satellite="${s.satellite}" class="${s.satellite === state.satellite ? 'chosen' : ''} ${s.aboveMask ? '' : 'low'}">
      <th><button aria-pressed="${s.satellite === state.satellite}">${store.header.satellites[s.satellite]?.id ?? '?'}</button></th>
      <td>${fixed(s.elevation_deg, 1)}</td><td>${fixed(s.azimuth_deg, 1)}</td>
      <td class="word"><i class="${kVisibilityShapes[s.visibility] ?? ''}" style="background:${visibilityColour(s.visibility, state.theme)}"></i>${shortened(words.visibility[s.visibility])}</td>
      <td data-name="cn0">${fixed(s.cn0_dbhz, 1)}</td><td class="word">${shortened(words.lock[s.lock])}</td>
      <td>${s.used ? '✓' : s.excluded ? 'x' : ''}</td>
      <td data-name="excess">${fixed(s.excess_m, 2)}</td><td data-name="error">${fixed(s.pseudorange_error_m, 2)}</td>
      <td data-name="residual">${fixed(s.residual_m, 2)}</td></tr>`)}`);
    if (focused) this.body.querySelector<HTMLElement>(`[data-satellite="${focused}"] button`)?.focus({ preventScroll: true });
  }
}

/** The selected satellite's paths, or the selected building. */
export class Details {
  /** @param cell text of a heat map's cell */
  constructor(private readonly host: HTMLElement, private readonly store: Store, private readonly state: State,
              private readonly cell: (column: number, row: number) => Html = () => html``) {
    state.listen((change) => change !== 'playing' && change !== 'camera' && this.update());
    this.update();
  }

  private update(): void {
    const { state } = this;
    if (state.cell) fill(this.host, this.cell(state.cell.column, state.cell.row));
    else if (state.object !== null) fill(this.host, this.building(state.object));
    else if (state.satellite !== null) fill(this.host, this.satellite(state.satellite));
    else fill(this.host, html`<p class="hint">Click a satellite or a building.</p>`);
  }

  private building(index: number): Html {
    const o = this.store.header.city.objects[index];
    if (!o) return html``;
    const sources: Record<string, string> = {
      height: 'tagged in the map', levels: 'storeys in the map', default: 'a default: not in the map',
    };
    const source = o.height_source ? (sources[o.height_source] ?? o.height_source) : 'unknown: the city is a mesh, or synthetic';
    return html`<h3>${o.id}</h3><dl class="pairs">
      <dt>kind</dt><dd>${o.surface}</dd>
      <dt>height</dt><dd data-name="height">${fixed(o.high_m - o.low_m, 1)} m</dd>
      <dt>height from</dt><dd>${source}</dd>
      <dt>top, base (up)</dt><dd>${fixed(o.high_m, 1)} m, ${fixed(o.low_m, 1)} m</dd>
      <dt>material</dt><dd>${o.material}, by area</dd></dl>`;
  }

  private satellite(index: number): Html {
    const { store, state } = this;
    const id = store.header.satellites[index];
    if (!id) return html``;
    const row = store.satellites(state.receiver, state.epoch).find((s) => s.satellite === index);
    if (!row) return html`<h3>${id.id} <small>${id.system}</small></h3><p class="hint">below the horizon at this time</p>`;
    const words = store.header.words;
    const paths = row.paths.map((p) => html`<tr><td class="word">${words.path[p.kind] ?? ''}${p.order > 1 ? `, ${p.order} times` : ''}</td>
      <td>${fixed(p.excess_m, 2)}</td><td>${fixed(p.loss_db, 1)}</td></tr>`);
    const most = row.paths.length >= store.header.paths_per_satellite && !store.header.comparison ? `the first and the strongest; at most ${store.header.paths_per_satellite} are stored` : '';
    return html`<h3>${id.id} <small>${id.system}, ${words.visibility[row.visibility] ?? ''}, ${words.lock[row.lock] ?? ''}</small></h3>
      <dl class="pairs">
      <dt>azimuth, elevation</dt><dd>${fixed(row.azimuth_deg, 1)}°, ${fixed(row.elevation_deg, 1)}°</dd>
      <dt>C/N0 stated, true</dt><dd>${fixed(row.cn0_dbhz, 1)}, ${fixed(row.true_cn0_dbhz, 1)} dB-Hz</dd>
      <dt>pseudorange error</dt><dd>${fixed(row.pseudorange_error_m, 2)} m, of it ${fixed(row.excess_m, 2)} m by paths</dd>
      <dt>in the fix</dt><dd>${row.used ? `yes, residual ${fixed(row.residual_m, 2)} m` : row.excluded ? 'excluded' : 'no'}</dd></dl>
      ${row.paths.length === 0 ? html`<p class="hint">nothing arrives</p>` : html`<table class="paths"><thead><tr><th>path</th><th>excess m</th><th>loss dB</th></tr></thead>
      <tbody>${paths}</tbody></table><p class="hint">${most}</p>`}`;
  }
}

export function summaryHtml(store: Store, receiver: number): Html {
  const run = store.header.receivers[receiver]?.summary;
  const s = store.header.live || !run?.epochs ? null : run;  // an unfinished run has no metrics
  const city = store.header.city;
  const origin = store.header.frame.origin;
  const buildings = city.objects.filter((o) => o.surface === 'building').length;
  const rows = !s ? [] : (store.header.figures ?? []).filter((f) => typeof s[f.name] === 'number').map((f) =>
    html`<dt title="${f.about}">${f.label}</dt><dd data-name="${f.name}">${fixed((s[f.name] ?? NaN) * f.factor, f.decimals)} ${f.unit}</dd>`);
  return html`<dl class="pairs">${rows}
    <dt>city</dt><dd>${city.name}: ${buildings} buildings, ${city.triangles} triangles</dd>
    <dt>frame</dt><dd>east, north, up [m] about ${fixed(origin.latitude_deg, 6)}°, ${fixed(origin.longitude_deg, 6)}°, ${fixed(origin.height_m, 1)} m (WGS 84)</dd></dl>
    ${city.notes.map((n) => html`<p class="hint">${n}</p>`)}`;
}
