// Canyon in one page: dropped files become a scenario, a worker runs it, and the viewer shows it in a frame.
import './web.css';
import { isMap, parseDocument } from 'yaml';
import { gunzip, unpacked } from './format';
import type { Message, ProbeMessage } from './messages';
import { by } from './text';
import type { Question } from './web_worker';

type Box = [number, number, number, number];
type Answer = Record<string, unknown> & { error?: string };

/** The worker, with one request at a time. */
class Engine {
  private readonly worker = new Worker(URL.createObjectURL(new Blob([text('canyon-module'), text('canyon-worker')])));
  private readonly waiting = new Map<number, (answer: Answer) => void>();
  private last = 0;

  constructor(progress: (share: number) => void) {
    this.worker.onmessage = ({ data }: MessageEvent<{ id: number; answer: Answer; progress?: number }>) => {
      if (data.progress !== undefined) return progress(data.progress);
      this.waiting.get(data.id)?.(data.answer);
      this.waiting.delete(data.id);
    };
  }
  /** Throws the module's error. */
  async ask(what: string, more: object = {}): Promise<Answer> {
    const question: Question = { id: ++this.last, do: what, ...more };
    const answer = await new Promise<Answer>((resolve) => {
      this.waiting.set(question.id, resolve);
      this.worker.postMessage(question);
    });
    if (answer.error) throw new Error(answer.error);
    return answer;
  }
  async read(path: string): Promise<Blob> {
    return new Blob([(await this.ask('read', { path }))['bytes'] as BlobPart]);
  }
}

function text(id: string): string {
  return document.getElementById(id)?.textContent ?? '';
}

const kBusy = ['run', 'draw', 'map', 'demo'];
/** Approximate number of cells of a heat map: 1 to 2 s per thousand. */
const kCells = 4000;
const scenario = by<HTMLTextAreaElement>('scenario');
const frame = by<HTMLIFrameElement>('view');
const engine = new Engine((share) => (by<HTMLProgressElement>('progress').value = share));
/** Source files of the scenario, or files waiting for a city. */
let files = new Map<string, File>();
/** Corners of the drive being drawn [m, city's frame]; null: none. */
let corners: [number, number][] | null = null;
let last = Promise.resolve();

function say(what: string, bad = false): void {
  by('status').textContent = what;
  by('status').classList.toggle('bad', bad);
}

function failed(error: unknown): void {
  say(error instanceof Error ? error.message : String(error), true);
}

function post(type: 'arm' | 'look' | 'end'): void {
  frame.contentWindow?.postMessage({ type, version: 1 } satisfies Message, '*');
}

/** Runs after all earlier work has ended. */
function busy(what: string, work: () => Promise<void>): Promise<void> {
  const enable = (on: boolean): void => kBusy.forEach((id) => (by<HTMLButtonElement>(id).disabled = !on));
  return (last = last.then(async () => {
    enable(false);
    draw(null);
    say(what);
    await work().catch(failed);
    enable(true);
  }));
}

/** Shows out/page.html in the frame; resolves after its viewer has drawn it. */
async function show(): Promise<void> {
  const page = URL.createObjectURL(new Blob([await engine.read('out/page.html')], { type: 'text/html' }));
  frame.hidden = false;
  await new Promise((resolve) => {
    frame.onload = resolve;
    frame.src = `${page}#framed`;
  });
  URL.revokeObjectURL(page);
  document.body.dataset['shown'] = String(Number(document.body.dataset['shown'] ?? 0) + 1);
}

function save(name: string, blob: Blob): void {
  const link = Object.assign(document.createElement('a'), { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

function offer(made: string[]): void {
  const entries = ['scenario.yaml', ...made].map((path) => {
    const name = path.replace(/^out\//, '').replaceAll('/', '-');
    const button = Object.assign(document.createElement('button'), { textContent: name === 'page.html' ? 'page.html (this view)' : name });
    button.onclick = async () => save(name, await engine.read(path));
    const entry = document.createElement('li');
    entry.append(button);
    return entry;
  });
  by('made').replaceChildren(...entries);
  by('saves').hidden = false;
}

/** @param preview seconds of it that are shown first, so that the city appears at once; 0: none */
function run(preview = 0): Promise<void> {
  return busy('Computing', async () => {
    await engine.ask('write', { path: 'scenario.yaml', bytes: scenario.value });
    if (preview > 0) {
      await engine.ask('run', { seconds: preview });
      await show();
    }
    const result = await engine.ask('run');
    await show();
    offer(result['files'] as string[]);
    by('report').textContent = (result['report'] as string[]).join('\n');
    const seconds = result['seconds'] as number;
    say(`Computed in ${seconds.toFixed(1)} s. “Put antenna” traces another place.`);
    document.body.dataset['seconds'] = seconds.toFixed(2);
  });
}

/** Makes a scenario of these files and of earlier files that they do not replace, and runs it; drops files rejected by the module. */
async function take(dropped: Iterable<File>): Promise<void> {
  const added = new Map([...dropped].map((file) => [file.name, file]));
  let made = false;
  const wrong: string[] = [];
  await busy(`Reading ${[...added.keys()].join(', ')}`, async () => {
    for (const [name, file] of added) {
      if (!/\.(ya?ml|html)$/i.test(name)) await engine.ask('write', { path: name, bytes: new Uint8Array(await file.arrayBuffer()) });
      else if (added.delete(name)) wrong.push(`${name}: has no place in a new scenario; paste the text of one into the box “Scenario”`);
    }
    const all = new Map([...files, ...added]);
    if (wrong.length > 0 && added.size === 0) return;
    const result = await engine.ask('new', { files: [...added.keys()], kept: [...files.keys()].filter((name) => !added.has(name)),
      origin: by<HTMLInputElement>('origin').value.trim() });
    files = new Map([...all].filter(([name]) => (result['files'] as string[]).includes(name)));
    wrong.push(...(result['messages'] as string[]));
    by('origin-line').hidden = ![...files.keys()].some((name) => /\.(gl[bt]f?|obj|ply|stl)(\.gz)?$/i.test(name));
    if (result['yaml'] === undefined) return;
    scenario.value = result['yaml'] as string;
    by('report').textContent = (result['facts'] as string[]).join('\n');
    made = true;
  });
  if (made) await run();
  if (wrong.length > 0) say([...(made ? [by('status').textContent] : []), ...wrong].join('\n'), true);
}

/** Indents further lines in brackets, which the module also reads unindented. */
function indented(yaml: string): string {
  let depth = 0;
  return yaml.replace(/"(?:\\.|[^"\\])*"|'[^']*'|(?<=^|\s)#.*|[[\]{}\n]/gm, (part) => {
    depth += '[{'.includes(part) ? 1 : ']}'.includes(part) ? -1 : 0;
    return part === '\n' && depth > 0 ? '\n  ' : part;
  });
}

/** The scenario with a drive through corners instead of its trajectory. */
function along(yaml: string, way: [number, number][]): string {
  let document = parseDocument(yaml, { strict: false });
  if (document.errors[0]) document = parseDocument(indented(yaml), { strict: false });
  if (document.errors[0]) throw document.errors[0];
  if (document.contents && !isMap(document.contents)) throw new Error('The scenario has no keys: load one first');
  const points = way.map(([e, n]) => `  - {east_m: ${e.toFixed(1)}, north_m: ${n.toFixed(1)}}\n`).join('');
  document.set('trajectory', parseDocument(`waypoints:\n${points}speed_mps: 8\nheight_above_terrain_m: 1.5\n`).contents);
  return document.toString({ lineWidth: 0, flowCollectionPadding: false });
}

/** @param way corners so far; null: the drawing has ended */
function draw(way: typeof corners): void {
  if (corners && !way) post('end');
  corners = way;
  by('draw').textContent = !way ? 'Draw a route' : way.length > 1 ? `Drive through ${way.length} corners` : 'Stop drawing';
}

function stopDrawing(): void {
  if (!corners) return;
  draw(null);
  say('No drive was drawn.');
}

by('draw').onclick = () => {
  if (!corners) {
    draw([]);
    say('Click the corners of the drive on the street, one after the other; Escape ends it');
    return post('arm');
  }
  if (corners.length < 2) return stopDrawing();
  try {
    scenario.value = along(scenario.value, corners);
    void run();
  } catch (error) {
    failed(error);
  }
};
addEventListener('keydown', (event) => event.key === 'Escape' && stopDrawing());

/** @param box west, south, east, north of the visible area [m, city's frame] */
function map(box: Box): Promise<void> {
  return busy('Computing the heat map', async () => {
    const [west, south, east, north] = box;
    const spacing_m = Math.max(1, Math.ceil(Math.sqrt(((east - west) * (north - south)) / kCells)));
    await engine.ask('map', { box, spacing_m });
    await show();
    say(`Heat map in cells of ${spacing_m} m, at the run’s first instant.`);
  });
}

by('map').onclick = () => post('look');

// Requests of the viewer in the frame.
addEventListener('message', async (event: MessageEvent<ProbeMessage | { type: 'look'; box: Box } | { type: 'end' }>) => {
  if (event.source !== frame.contentWindow) return;
  if (event.data?.type === 'look') return void map(event.data.box);
  if (event.data?.type === 'end') return stopDrawing();
  if (event.data?.type !== 'probe') return;
  const { answer } = await engine.ask('probe', { message: JSON.stringify(event.data) });
  frame.contentWindow?.postMessage(JSON.parse(answer as string), '*');
  const { east_m, north_m } = event.data.place;
  const [east, north] = corners?.at(-1) ?? [];
  if (!corners || (east === east_m && north === north_m)) return;  // an antenna sends a request for each instant
  draw([...corners, [east_m, north_m]]);
  post('arm');
});

function demo(): Promise<void> {
  files.clear();
  by('origin-line').hidden = true;
  scenario.value = text('canyon-demo');
  return run(2);
}

by('run').onclick = () => void run();
by('demo').onclick = () => void demo();
by('origin').onchange = () => void (files.size > 0 && take([]));
by<HTMLInputElement>('files').onchange = (event) => {
  const box = event.target as HTMLInputElement;
  void take([...(box.files ?? [])]);
  box.value = '';  // so that a file of the same name can be selected again
};
for (const kind of ['dragover', 'dragleave', 'drop'] as const) {
  addEventListener(kind, (event) => {
    event.preventDefault();
    by('drop').classList.toggle('over', kind === 'dragover');
    const dropped = [...((event as DragEvent).dataTransfer?.files ?? [])];
    if (kind === 'drop' && dropped.length > 0) void take(dropped);
  });
}

void (async () => {
  const wasm = await gunzip(unpacked(text('canyon-wasm')), 'the module');
  await engine.ask('start', { bytes: new Uint8Array(wasm) });
  await engine.ask('write', { path: 'viewer.html', bytes: new TextDecoder().decode(unpacked(text('canyon-viewer'))) });
  document.body.dataset['loaded'] = 'true';
  await demo();
})().catch((error: unknown) => say(`The module does not start: ${String(error)}`, true));
