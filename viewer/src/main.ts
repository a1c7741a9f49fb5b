import './style.css';
import { Chart, type ChartKind } from './charts';
import { SignalBars } from './bars';
import { checkHeader, openSource, type Header, type MapHeader } from './format';
import { HeatMap } from './heatmap';
import { helpHtml } from './help';
import { Live } from './live';
import { MapPanel } from './mappanel';
import { outline } from './lines';
import { Connection, FrameConnection, type Message } from './messages';
import { kErrorColour, kindColour, kPaint, receiverColour, receiverShape, visibilityColour } from './palette';
import { Details, EpochTable, Readout, SatelliteTable, summaryHtml } from './panels';
import { Probe } from './probe';
import { SceneView } from './scene';
import { mark, SkyPlot } from './skyplot';
import { kLayers, State, type CameraMode, type Layer } from './state';
import { Store, type Track } from './store';
import { by, clock, fill, html } from './text';
import { Timeline } from './timeline';

const kSpeeds = [0.25, 0.5, 1, 2, 5, 10, 20, 60];

/** Seconds of a heat map's time since the view's beginning. */
function secondsOf(header: Header, time: number): number {
  const seconds = (Date.parse(header.map?.times_utc[time] ?? '') - Date.parse(header.time?.begin_utc ?? '')) / 1000;
  return Number.isFinite(seconds) ? seconds : 0;
}

class App {
  readonly state = new State();
  private toastTimer = 0;
  private lastFrame = 0;
  private view!: SceneView;
  private live: Live | null = null;
  probe!: Probe;

  constructor(readonly store: Store, private readonly served: boolean) {}

  async start(): Promise<void> {
    const { state, store } = this;
    const header = store.header;
    by('title').replaceChildren(header.title, Object.assign(document.createElement('small'), {
      textContent: header.time ? `${header.time.begin_utc.slice(0, 10)}, ${header.city.name}` : header.city.name,
    }));
    document.title = `${header.title} – Canyon`;
    const [glb] = await Promise.all([store.city(), store.loadTracks()]);
    const timed = header.live === true || store.tracks.some((t) => t.size > 0);
    // Without receivers there is no sky view; with receivers and no time an antenna can be put.
    const skied = header.receivers.length > 0;
    document.body.classList.toggle('no-time', !timed);
    if (!timed) state.camera = 'free';
    if (matchMedia('(prefers-color-scheme: dark)').matches) state.theme = 'dark';
    document.documentElement.dataset['theme'] = state.theme;
    this.view = new SceneView(by('stage'), by('overlay'), glb, store, state);
    this.view.control.setMode(state.camera);
    this.connect();
    if (timed) {
      this.show(0);
      await store.load(0, 0);
    }
    if (skied) {
      new SkyPlot(by('skyplot'), store, state);
      new SignalBars(by('bars'), store, state);
      new Readout(by('readout'), store, state);
      new SatelliteTable(by('tab-satellites'), store, state);
      new EpochTable(by('tab-epoch'), store, state);
    }
    if (timed) {
      this.chart = new Chart(by('chart'), store, state, (s) => this.goTo(s), {
        receiver: () => (this.probe?.active ? this.probe.base : state.receiver),
        has: (receiver) => receiver !== this.probe?.receiver,
      });
      new Timeline(by('timeline'), store, state, (s) => this.goTo(s));
    }
    if (header.map) await this.showMap(header.map);
    new Details(by('tab-details'), store, state, (column, row) => this.heat?.cellHtml(column, row) ?? html``);
    by('tab-details').addEventListener('click', (e) => {
      const { cell } = state;
      if (!cell || !this.heat || !(e.target as Element).closest('[data-put]')) return;
      const { foot, height } = this.heat.footOf(cell.column, cell.row);
      this.probe.put(foot, height);
    });
    this.header(timed);
    this.tabs();
    this.keys(timed);
    this.legend(skied);
    state.listen((change) => change === 'look' && this.legend(skied));
    state.listen((change) => {
      if (change === 'receiver') this.receiverChanged();
      if (change === 'map' && !timed && header.map && this.heat) this.probe.goTo(secondsOf(header, this.heat.time));
      if (change === 'selection' && (state.satellite !== null || state.object !== null || state.cell)) this.showTab('details');
      if (change === 'time' && header.time) {
        by('clock').textContent = `${clock(header.time.begin_utc, state.time)} UTC`;
        by('clock').title = `${state.time.toFixed(1)} s since ${header.time.begin_gpst}`;
      }
    });
    state.changed('time');
    this.receiverChanged();
    requestAnimationFrame((t) => this.frame(t));
    // The first picture does not wait for the rest of the run.
    if (timed) void this.loadAll();
  }

  private async loadAll(): Promise<void> {
    for (let r = 0; r < this.store.tracks.length; ++r) {
      await this.store.loadAround(r, 0, () => {});
      this.state.changed('data');
    }
  }

  heat: HeatMap | null = null;
  private panel: MapPanel | null = null;
  private async showMap(map: MapHeader): Promise<void> {
    this.heat = new HeatMap(this.store, map, this.state);
    await this.heat.show();
    by('map').hidden = false;
    const panel = new MapPanel(by('map'), map, this.heat, this.state);
    this.view.showMap(this.heat, (cell) => panel.read(cell));
    this.panel = panel;
    this.state.changed('map');
  }

  /** The line to the `canyon view` that served the page; an exported page has none. */
  private connect(): void {
    const Line = this.served ? Connection : FrameConnection.here ? FrameConnection : null;
    const connection = Line && new Line((m) => this.take(m), () => this.lineChanged(connection));
    this.probe = new Probe(this.store, this.state, connection, {
      toast: (text) => this.toast(text),
      arm: (on) => {
        this.view.putting = on;
        by('stage').classList.toggle('putting', on);
      },
    });
    this.view.onPut = (place) => this.probe.put(place);
    this.view.onBody = (what) => this.toast(what);
    by('put').onclick = () => this.probe.arm();
    if (!this.store.header.live || !connection) return;
    this.live = new Live(this.store, this.state, connection, by('follow-live'), {
      goTo: (seconds) => this.show(seconds),
      redraw: () => {
        this.state.changed('data');
        this.chart?.show(this.chart.kind);
      },
    });
  }

  private take(message: Message): void {
    if (message.type === 'hello') this.live?.hello(message);
    else if (message.type === 'progress') this.live?.computed(message);
    else if (message.type === 'finished') void this.finished();
    else if (message.type === 'arm') this.probe.arm();
    else if (message.type === 'end') this.probe.end();
    else if (message.type === 'look') parent.postMessage({ type: 'look', box: this.view.groundBox() }, '*');
    else if (message.type === 'error' && message.id === undefined) this.failed(message.message);
    else if (!this.probe.take(message) && message.type === 'epoch') this.live?.take(message);
  }

  /** A run that was shown during its computation has ended: loads all of it, and keeps the page's state. */
  private async finished(): Promise<void> {
    const { live, state, store } = this;
    if (!live) return;
    this.live = null;
    await store.adopt();
    live.end();
    this.show(state.time);
    state.changed('receiver');
    await this.loadAll();
  }

  /** The run in computation. */
  private failed(why: string): void {
    this.live?.fail(() => this.toast(why, Infinity));
    this.live = null;
    this.over = true;
  }

  private lineWasOpen = false;
  private over = false;  // its reason was shown
  private lineChanged(connection: Connection | null): void {
    if (connection && !connection.open) {
      this.probe?.lost();
      if (!this.live && !this.over && this.lineWasOpen) this.toast('“canyon view” has ended: data that is not loaded is not available, and antennas cannot be put.');
    }
    this.lineWasOpen = connection?.open ?? false;
    this.live?.say();
  }

  /** Goes to a time [s] and loads its satellites; stops following a live run. */
  goTo(seconds: number): void {
    this.live?.follow(seconds >= this.store.span[1]);
    by('toast').classList.remove('shown');
    this.show(seconds);
  }

  private show(seconds: number): void {
    const { state, store } = this;
    if (state.receiver === this.probe?.receiver) return this.probe.goTo(seconds);
    const track = store.tracks[state.receiver];
    if (!track || track.size === 0) return;
    const last = track.time[track.size - 1] ?? 0;
    state.time = Math.min(last, Math.max(track.time[0] ?? 0, seconds));
    const epoch = track.epochAt(state.time);
    state.epoch = epoch;
    if (!store.loaded(state.receiver, epoch)) {
      void store.load(state.receiver, epoch).then(() => state.epoch === epoch && state.changed('data'));
    } else if (epoch + 1 < track.size && !store.loaded(state.receiver, Math.min(track.size - 1, epoch + 40))) {
      void store.load(state.receiver, Math.min(track.size - 1, epoch + 40));
    }
    state.changed('time');
  }

  /** The track that defines time: for an antenna put by the user, the run's. */
  private get clock(): Track | undefined {
    return this.store.tracks[this.probe.active ? this.probe.base : this.state.receiver];
  }

  private step(epochs: number): void {
    const track = this.clock;
    if (!track) return;
    const epoch = Math.min(track.size - 1, Math.max(0, track.epochAt(this.state.time) + epochs));
    this.goTo(track.time[epoch] ?? 0);
  }

  private play(on: boolean): void {
    const { state } = this;
    const track = this.clock;
    if (on && track && track.epochAt(state.time) >= track.size - 1) this.goTo(0);
    state.playing = on;
    by('play').textContent = on ? 'Pause' : 'Play';
    this.lastFrame = 0;
    state.changed('playing');
  }

  private frame(now: number): void {
    requestAnimationFrame((t) => this.frame(t));
    const { state } = this;
    if (state.playing) {
      const step = this.lastFrame > 0 ? Math.min(0.25, (now - this.lastFrame) / 1000) : 0;
      const track = this.clock;
      this.lastFrame = now;
      const time = state.time + step * state.speed;
      // Panels are drawn once per epoch, not once per picture.
      if (track && track.epochAt(time) !== track.epochAt(state.time)) this.goTo(time);
      else state.time = time;
      if (track && time >= (track.time[track.size - 1] ?? 0)) this.play(false);
    }
    this.live?.frame(now);
    this.view.frame();
  }

  nextLoss(): void {
    const track = this.clock;
    if (!track) return;
    const now = track.epochAt(this.state.time);
    for (let k = 1; k <= track.size; ++k) {
      const i = (now + k) % track.size;
      if (!track.fixed(i) && (i === 0 || track.fixed(i - 1))) return this.goTo(track.time[i] ?? 0);
    }
    this.toast('This run never loses its fix.');
  }

  largestError(): void {
    const track = this.clock;
    if (!track) return;
    let best = -1;
    track.horizontal.forEach((e, i) => {
      if (Number.isFinite(e) && (best < 0 || e > (track.horizontal[best] ?? 0))) best = i;
    });
    if (best < 0) return this.toast('This run has no fix.');
    this.goTo(track.time[best] ?? 0);
  }

  /** Goes to the largest difference of recorded and simulated; again: to the street with the next largest. */
  nextDifference(): void {
    const { state, store } = this;
    const most = store.differences();
    const epoch = most[(most.indexOf(state.epoch) + 1) % Math.max(1, most.length)];
    const track = store.tracks[store.header.comparison?.recorded ?? 0];
    if (epoch === undefined || !track) return this.toast('No signal here was both measured and simulated.');
    this.goTo(track.time[epoch] ?? 0);
    this.toast(`Pseudoranges differ by ${(store.comparison?.at('difference_rms_m', epoch) ?? NaN).toFixed(1)} m (rms of ${
      store.comparison?.at('both', epoch) ?? 0} satellites): ${most.indexOf(epoch) + 1} of ${most.length} streets`);
  }

  private toast(text: string, seconds = 5): void {
    const toast = by('toast');
    toast.textContent = text;
    toast.classList.add('shown');
    clearTimeout(this.toastTimer);
    if (seconds < Infinity) this.toastTimer = window.setTimeout(() => toast.classList.remove('shown'), 1000 * seconds);
  }

  private receiverChanged(): void {
    const { state, store } = this;
    const put = this.probe.active && state.receiver === this.probe.receiver;
    document.body.classList.toggle('put', put);
    fill(by('tab-summary'), summaryHtml(store, state.receiver));
    if (store.tracks[state.receiver]) this.show(state.time);
  }

  private setCamera(mode: CameraMode): void {
    this.state.camera = mode;
    for (const b of document.querySelectorAll<HTMLElement>('#cameras button')) {
      b.setAttribute('aria-pressed', String(b.dataset['camera'] === mode));
    }
    this.state.changed('camera');
  }

  private look(): void {
    document.documentElement.dataset['theme'] = this.state.theme;
    by('theme').textContent = this.state.theme === 'dark' ? 'Light' : 'Dark';
    by<HTMLSelectElement>('colour').value = this.state.colour;
    this.state.changed('look');
  }

  private header(timed: boolean): void {
    const { state, store } = this;
    const receiver = by<HTMLSelectElement>('receiver');
    store.header.receivers.forEach((r, i) => receiver.add(new Option(r.name, String(i))));
    by('receiver-choice').hidden = store.header.receivers.length < 2;
    receiver.onchange = () => {
      this.probe.end();
      state.receiver = Number(receiver.value);
      state.changed('receiver');
      void store.loadAround(state.receiver, state.epoch, () => {}).then(() => state.changed('data'));
    };
    for (const b of document.querySelectorAll<HTMLElement>('#cameras button')) {
      b.onclick = () => this.setCamera(b.dataset['camera'] as CameraMode);
      b.hidden = !timed && (b.dataset['camera'] === 'follow' || b.dataset['camera'] === 'first');
    }
    this.setCamera(state.camera);
    by('colour').onchange = () => {
      state.colour = by<HTMLSelectElement>('colour').value as 'height' | 'material';
      this.look();
    };
    by('theme').onclick = () => {
      state.theme = state.theme === 'dark' ? 'light' : 'dark';
      this.look();
    };
    this.look();
    by('layers').hidden = store.header.receivers.length === 0;
    const layers = document.querySelector('#layers div') as HTMLElement;
    for (const [layer, what] of Object.entries(kLayers) as [Layer, string][]) {
      if (layer === 'ranges' && !store.comparison) continue;
      if (layer === 'others' && store.header.receivers.length < 2) continue;
      const box = Object.assign(document.createElement('input'), { type: 'checkbox', checked: state.layers[layer] });
      box.onchange = () => {
        state.layers[layer] = box.checked;
        state.changed('layers');
      };
      const label = document.createElement('label');
      label.append(box, ` ${what}`);
      layers.append(label);
    }
    const help = by<HTMLDialogElement>('help');
    fill(help, helpHtml());
    by('help-button').onclick = () => help.showModal();
    by('play').onclick = () => this.play(!state.playing);
    by('back').onclick = () => this.step(-1);
    by('forward').onclick = () => this.step(1);
    by('next-loss').onclick = () => this.nextLoss();
    by('largest').onclick = () => this.largestError();
    by('difference').onclick = () => this.nextDifference();
    by('difference').hidden = by('ranges').hidden = store.comparison === null;
    const speed = by<HTMLSelectElement>('speed');
    for (const s of kSpeeds) speed.add(new Option(`${s}×`, String(s), s === 1, s === 1));
    speed.onchange = () => (state.speed = Number(speed.value));
  }

  private showTab(name: string): void {
    for (const b of document.querySelectorAll<HTMLElement>('#tabs button')) {
      b.setAttribute('aria-selected', String(b.dataset['tab'] === name));
      by(`tab-${b.dataset['tab'] ?? ''}`).hidden = b.dataset['tab'] !== name;
    }
  }

  private tabs(): void {
    for (const b of document.querySelectorAll<HTMLElement>('#tabs button')) {
      b.onclick = () => this.showTab(b.dataset['tab'] ?? 'summary');
    }
    if (document.body.classList.contains('no-time')) this.showTab('summary');
    for (const b of document.querySelectorAll<HTMLElement>('#chart-kinds button')) {
      b.onclick = () => this.showChart(b.dataset['chart'] as ChartKind);
    }
    this.showChart(this.store.comparison ? 'ranges' : 'error');
  }

  private chart: Chart | null = null;
  private showChart(kind: ChartKind): void {
    for (const b of document.querySelectorAll<HTMLElement>('#chart-kinds button')) {
      b.setAttribute('aria-pressed', String(b.dataset['chart'] === kind));
    }
    this.chart?.show(kind);
  }

  private keys(timed: boolean): void {
    const { state, store } = this;
    const neighbour = (way: number): void => {
      const rows = store.satellites(state.receiver, state.epoch, false);
      if (rows.length === 0) return;
      const at = rows.findIndex((r) => r.satellite === state.satellite);
      const next = rows[(at + way + rows.length + (at < 0 && way < 0 ? 1 : 0)) % rows.length];
      if (next) state.selectSatellite(next.satellite);
    };
    const faster = (way: number): void => {
      const i = Math.min(kSpeeds.length - 1, Math.max(0, kSpeeds.indexOf(state.speed) + way));
      state.speed = kSpeeds[i] ?? 1;
      by<HTMLSelectElement>('speed').value = String(state.speed);
    };
    const actions: Record<string, (shift: boolean) => void> = {
      '1': () => this.setCamera('free'), '3': () => this.setCamera('top'),
      Escape: () => { this.probe.end(); state.satellite = null; state.selectObject(null); },
      p: () => this.probe.arm(),
      c: () => { state.colour = state.colour === 'height' ? 'material' : 'height'; this.look(); },
      ...(this.heat ? { m: () => this.panel?.toggle(), ',': () => this.heat?.step(-1), '.': () => this.heat?.step(1) } : {}),
      d: () => by('theme').click(), '?': () => by<HTMLDialogElement>('help').showModal(),
      ...(timed ? {
        ' ': () => this.play(!state.playing), ArrowLeft: (s: boolean) => this.step(s ? -10 : -1),
        ArrowRight: (s: boolean) => this.step(s ? 10 : 1), Home: () => this.goTo(0), End: () => this.goTo(Infinity),
        '+': () => faster(1), '-': () => faster(-1), l: () => this.nextLoss(), e: () => this.largestError(),
        ...(store.comparison ? { v: () => this.nextDifference() } : {}),
        '2': () => this.setCamera('follow'), '4': () => this.setCamera('first'), n: (s: boolean) => neighbour(s ? -1 : 1),
      } : {}),
    };
    const layers = by<HTMLDetailsElement>('layers');
    const closeLayers = (): void => {
      layers.open = false;
    };
    addEventListener('pointerdown', (e) => !layers.contains(e.target as Node) && closeLayers());
    // A button clicked with a mouse does not capture keys; one reached by Tab does.
    addEventListener('click', (e) => e.detail > 0 && (e.target as HTMLElement).closest('button')?.blur());
    addEventListener('keydown', (e) => {
      const at = e.target as HTMLElement;
      // A number box captures all keys except those that leave it.
      if (at.tagName === 'INPUT' && ['Escape', 'Enter'].includes(e.key)) at.blur();
      if (e.key === 'Escape') closeLayers();
      if (e.ctrlKey || e.altKey || e.metaKey || at.tagName === 'SELECT' || (at.tagName === 'INPUT' && e.key !== 'Escape' && ['number', 'text'].includes((at as HTMLInputElement).type)) || by<HTMLDialogElement>('help').open) return;
      if (at.tagName === 'BUTTON' && (e.key === ' ' || e.key === 'Enter')) return;
      const action = actions[e.key.length === 1 ? e.key.toLowerCase() : e.key];
      if (!action) return;
      e.preventDefault();
      action(e.shiftKey);
    });
  }

  private legend(timed: boolean): void {
    by('legend').textContent = '';
    by('legend').hidden = !timed;
    if (!timed) return;
    const add = (text: string, draw: (c: CanvasRenderingContext2D) => void): void => {
      const canvas = Object.assign(document.createElement('canvas'), { width: 32, height: 28 });
      canvas.style.width = '16px';
      canvas.style.height = '14px';
      const c = canvas.getContext('2d', { willReadFrequently: true });
      if (c) {
        c.scale(2, 2);
        draw(c);
      }
      const span = document.createElement('span');
      span.append(canvas, text);
      by('legend').append(span);
    };
    const line = (colour: string) => (c: CanvasRenderingContext2D) => {
      c.fillStyle = colour;
      c.fillRect(0, 5.5, 16, 3);
    };
    this.store.header.words.visibility.forEach((word, i) =>
      add(word, (c) => mark(c, i, 8, 7, 5, visibilityColour(i, this.state.theme), '#0000')));
    if (this.store.corrected(0)) ['fixed', 'float', 'differential', 'single'].forEach((kind) => add(kind, line(kindColour(kind))));
    else add('truth', line(kPaint[this.state.theme].truth));
    const { receivers } = this.store.header;
    receivers.forEach((receiver, i) => add(receivers.length > 1 ? `fix, ${receiver.name}` : 'fix, 95 %', (c) => {
      c.fillStyle = receiverColour(i, this.state.theme);
      c.fillRect(0, 5.5, 16, 3);
      c.translate(2, 1);
      outline(c, receiverShape(i), 12);
      c.fill();
    }));
    add(receivers.length > 1 ? 'no fix' : 'error; track without fix', line(kErrorColour));
  }

  /** For `canyon view --record`: a picture at a fraction of the film. A run is played; a city alone is circled once. */
  async film(at: { share: number; from?: number; until?: number; camera?: CameraMode }): Promise<void> {
    const { state, store } = this;
    if (at.camera && at.camera !== state.camera) this.setCamera(at.camera);
    const track = store.tracks[state.receiver];
    if (track && track.size > 0) {
      const last = track.time[track.size - 1] ?? 0;
      const from = at.from ?? 0;
      const until = Math.min(last, at.until ?? last);
      const time = from + at.share * (until - from);
      await store.load(state.receiver, track.epochAt(time));
      this.goTo(time);
      // Slow, at walking pace, so that depth is visible.
      this.filmed ??= this.view.control.azimuth;
      if (state.camera === 'follow') this.view.control.azimuth = this.filmed + 40 * at.share;
    } else {
      this.filmed ??= this.view.control.azimuth;
      this.view.control.azimuth = this.filmed + 360 * at.share;
    }
    this.view.sharpen();
    // The second frame is after the first one's picture.
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  }
  private filmed: number | null = null;

  /** For tests and measurements. */
  get scene(): SceneView {
    return this.view;
  }
}

async function main(): Promise<void> {
  try {
    const source = openSource();
    const header: Header | null = await source.header();
    checkHeader(header);
    const app = new App(new Store(source, header), source.served);
    (window as unknown as { canyon: App }).canyon = app;
    await app.start();
    document.body.dataset['loaded'] = 'true';
  } catch (error) {
    const message = document.createElement('p');
    message.className = 'fatal';
    message.textContent = error instanceof Error ? error.message : String(error);
    document.body.replaceChildren(message);
    console.error(error);
  }
}

void main();
