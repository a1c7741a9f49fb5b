// Canyon in one page: what is dropped becomes a scenario, a worker runs it, and the viewer shows it in a frame.
import './web.css';
import { gunzip, unpacked } from './format';
import type { Message, ProbeMessage } from './messages';
import { by } from './text';
import type { Question } from './web_worker';

type Box = [number, number, number, number];
type Answer = Record<string, unknown> & { error?: string };

/** The worker, asked one question at a time. */
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
  /** Throws what the module says is wrong. */
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
/** Cells of a heat map, about: a second or two for a thousand. */
const kCells = 4000;
const scenario = by<HTMLTextAreaElement>('scenario');
const frame = by<HTMLIFrameElement>('view');
const engine = new Engine((share) => (by<HTMLProgressElement>('progress').value = share));
const files = new Map<string, File>();
/** Corners of a drive that is being drawn [m, city's frame]; null: none is. */
let way: [number, number][] | null = null;

function say(what: string, bad = false): void {
  by('status').textContent = what;
  by('status').classList.toggle('bad', bad);
}

async function busy(what: string, work: () => Promise<void>): Promise<void> {
  const enable = (on: boolean): void => kBusy.forEach((id) => (by<HTMLButtonElement>(id).disabled = !on));
  enable(false);
  say(what);
  try {
    await work();
  } catch (error) {
    say(error instanceof Error ? error.message : String(error), true);
  }
  enable(true);
}

/** Shows out/page.html in the frame; resolves once its viewer has drawn it. */
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

/** @param preview s of it that are shown first, so that the city is there at once; 0: none */
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

/** Writes the scenario of all files that were dropped, and runs it. */
async function take(dropped: Iterable<File>): Promise<void> {
  for (const file of dropped) files.set(file.name, file);
  if (files.size === 0) return;
  let made = false;
  await busy(`Reading ${[...files.keys()].join(', ')}`, async () => {
    for (const [name, file] of files) await engine.ask('write', { path: name, bytes: new Uint8Array(await file.arrayBuffer()) });
    by('origin-line').hidden = ![...files.keys()].some((name) => /\.(gl[bt]f?|obj|ply|stl)(\.gz)?$/i.test(name));
    const { yaml, facts } = await engine.ask('new', { files: [...files.keys()], origin: by<HTMLInputElement>('origin').value.trim() });
    scenario.value = yaml as string;
    by('report').textContent = (facts as string[]).join('\n');
    made = true;
  });
  if (made) await run();
}

/** The scenario with a drive through corners in place of its trajectory. */
function along(yaml: string, corners: [number, number][]): string {
  const points = corners.map(([e, n]) => `    - {east_m: ${e.toFixed(1)}, north_m: ${n.toFixed(1)}}\n`).join('');
  const drive = `trajectory:\n  waypoints:\n${points}  speed_mps: 8\n  height_above_terrain_m: 1.5\n`;
  const old = /^trajectory:.*\n(?:[ \t#].*\n|\n)*/m;
  return old.test(yaml) ? yaml.replace(old, drive) : `${yaml.trimEnd()}\n${drive}`;
}

by('draw').onclick = () => {
  if (way && way.length > 1) {
    scenario.value = along(scenario.value, way);
    way = null;
    by('draw').textContent = 'Draw a way';
    return void run();
  }
  way = [];
  say('Click the corners of the drive on the street, one after the other');
  frame.contentWindow?.postMessage({ type: 'arm', version: 1 } satisfies Message, '*');
};

/** @param box west, south, east, north of what is in view [m, city's frame] */
function map(box: Box): Promise<void> {
  return busy('Computing the heat map', async () => {
    const [west, south, east, north] = box;
    const spacing_m = Math.max(1, Math.ceil(Math.sqrt(((east - west) * (north - south)) / kCells)));
    await engine.ask('map', { box, spacing_m });
    await show();
    say(`Heat map in cells of ${spacing_m} m, at the run’s first instant.`);
  });
}

by('map').onclick = () => frame.contentWindow?.postMessage({ type: 'look', version: 1 } satisfies Message, '*');

// Questions of the viewer in the frame.
addEventListener('message', async (event: MessageEvent<ProbeMessage | { type: 'look'; box: Box }>) => {
  if (event.source !== frame.contentWindow) return;
  if (event.data?.type === 'look') return void map(event.data.box);
  if (event.data?.type !== 'probe') return;
  const { answer } = await engine.ask('probe', { message: JSON.stringify(event.data) });
  frame.contentWindow?.postMessage(JSON.parse(answer as string), '*');
  if (!way) return;
  way.push([event.data.place.east_m, event.data.place.north_m]);
  by('draw').textContent = way.length > 1 ? `Drive through ${way.length} corners` : 'Draw a way';
  frame.contentWindow?.postMessage({ type: 'arm', version: 1 } satisfies Message, '*');
});

function demo(): Promise<void> {
  files.clear();
  by('origin-line').hidden = true;
  scenario.value = text('canyon-demo');
  return run(2);
}

by('run').onclick = () => void run();
by('demo').onclick = () => void demo();
by('origin').onchange = () => void take([]);
by<HTMLInputElement>('files').onchange = (event) => void take((event.target as HTMLInputElement).files ?? []);
for (const kind of ['dragover', 'dragleave', 'drop'] as const) {
  addEventListener(kind, (event) => {
    event.preventDefault();
    by('drop').classList.toggle('over', kind === 'dragover');
    if (kind === 'drop') void take((event as DragEvent).dataTransfer?.files ?? []);
  });
}

void (async () => {
  const wasm = await gunzip(unpacked(text('canyon-wasm')), 'the module');
  await engine.ask('start', { bytes: new Uint8Array(wasm) });
  await engine.ask('write', { path: 'viewer.html', bytes: new TextDecoder().decode(unpacked(text('canyon-viewer'))) });
  document.body.dataset['loaded'] = 'true';
  await demo();
})().catch((error: unknown) => say(`The module does not start: ${String(error)}`, true));
