// Messages between this page and its server `canyon view` (docs/view-format.md, Messages).

import { decodeChunk, unpacked, type Header, type Rows } from './format';

export const kMessages = 1;

export interface EpochMessage {
  type: 'epoch';
  id?: number;
  receiver: string;
  time_s: number;
  place: { east_m: number | null; north_m: number | null; up_m: number | null };
  faults: string[];
  satellites: string[];
  /** Words of columns with open texts, instead of the header's. */
  words?: Record<string, string[]>;
  skyline?: number[];
  chunk: string;
}

export interface ErrorMessage {
  type: 'error';
  id?: number;
  message: string;
}

/** A live run at the server: another run needs another page. */
export interface HelloMessage {
  type: 'hello';
  begin_utc: string;
  begin_gpst: string;
  gps_week: number;
  gps_tow: number;
  interval_s: number;
  receivers: { name: string; strength: boolean; elevation_mask_deg: number }[];
}

/** Progress of a run in computation. */
export interface ProgressMessage {
  type: 'progress';
  done: number;
  planned: number;
}

/** `finished`: the run has ended, and is served completely. `arm`: report the next click, `end`: stop reporting; `look`: the visible area. */
export type Message = { version: number } & (EpochMessage | ErrorMessage | HelloMessage | ProgressMessage | { type: 'finished' } | { type: 'arm' } | { type: 'end' } | { type: 'look' });

export interface ProbeMessage {
  type: 'probe';
  version: number;
  id: number;
  receiver: number;
  time_s: number;
  place: { east_m: number; north_m: number; up_m: number };
}

/** Systems of satellites that are not in the header, by RINEX's letter. */
const kSystems: Record<string, string> = { G: 'GPS', R: 'GLONASS', E: 'Galileo', C: 'BeiDou', J: 'QZSS', I: 'NavIC', S: 'SBAS' };

/** The tables of an epoch; its satellites and words become indices in the header's lists, which are extended. */
export function tablesOf(message: EpochMessage, header: Header): Map<string, Rows> {
  const tables = decodeChunk(unpacked(message.chunk).buffer, header);
  const which = tables.get('satellites')?.column('satellite');
  if (!which || !tables.get('epochs') || !tables.get('paths')) throw new Error('an epoch lacks a table');
  const known = message.satellites.map((id) => {
    const index = header.satellites.findIndex((s) => s.id === id);
    return index >= 0 ? index : header.satellites.push({ id, system: kSystems[id[0] ?? ''] ?? '' }) - 1;
  });
  for (let i = 0; i < which.length; ++i) which[i] = known[which[i] ?? 0] ?? 0;
  for (const [column, words] of Object.entries(message.words ?? {})) {
    const list = (header.words[column] ??= []);
    const places = words.map((word) => (list.includes(word) ? list.indexOf(word) : list.push(word) - 1));
    for (const rows of tables.values()) {
      if (!rows.has(column)) continue;
      const values = rows.column(column);
      for (let i = 0; i < values.length; ++i) values[i] = places[values[i] ?? 0] ?? 0;
    }
  }
  return tables;
}

const kRetryMs = 1000;

/** The line to the server: reconnects every second when broken. */
export class Connection {
  private socket: WebSocket | null = null;
  private ended = false;
  open = false;

  /** @param onState after `open` has changed, and after every failed try */
  constructor(protected readonly onMessage: (message: Message) => void, private readonly onState: () => void) {
    addEventListener('pagehide', () => {
      this.ended = true;
      this.socket?.close();
    });
    this.connect();
  }

  /** False without a connection. */
  send(message: ProbeMessage): boolean {
    if (!this.open || !this.socket) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  protected connect(): void {
    if (this.ended) return;
    const socket = new WebSocket(`ws://${location.host}/messages`);
    this.socket = socket;
    socket.onopen = () => {
      this.open = true;
      this.onState();
    };
    socket.onmessage = (event) => {
      const message = JSON.parse(String(event.data)) as Message;
      if (message.version === kMessages) this.onMessage(message);
    };
    socket.onclose = () => {
      this.open = false;
      this.onState();
      setTimeout(() => this.connect(), kRetryMs);
    };
  }
}

/** The line to the parent page that computes: web.ts. */
export class FrameConnection extends Connection {
  static readonly here = location.hash === '#framed' && parent !== window;

  override send(message: ProbeMessage): boolean {
    parent.postMessage(message, '*');
    return true;
  }
  protected override connect(): void {
    this.open = true;
    addEventListener('message', (event) => event.source === parent && this.onMessage(event.data as Message));
    addEventListener('keydown', (event) => event.key === 'Escape' && parent.postMessage({ type: 'end' }, '*'));
  }
}
