// The loaded part of a run: all epochs of every receiver, and blocks of satellites and paths as needed.

import { decodeChunk, Rows, type ChunkEntry, type Header, type MapChunkEntry, type Source, type Values } from './format';
import { tablesOf, type EpochMessage } from './messages';
import type { Place } from './tracks';

/** Above this number of bytes (uncompressed) the least recently used blocks are dropped. */
export const kMostBlockBytes = 96e6;

/** Number of stored slices of a heat map. */
const kMostSlices = 8;

export class Track {
  readonly time: Float64Array;
  readonly east: Float64Array;
  readonly north: Float64Array;
  readonly up: Float64Array;
  readonly status: Uint8Array;
  /** Horizontal error [m], NaN without a fix. */
  readonly horizontal: Float64Array;

  /** @param skylines by the epochs' column, or one for each epoch */
  constructor(readonly epochs: Rows, private readonly skylines: Rows | readonly Float64Array[]) {
    this.time = epochs.column('time_s') as Float64Array;
    this.east = epochs.column('east_m') as Float64Array;
    this.north = epochs.column('north_m') as Float64Array;
    this.up = epochs.column('up_m') as Float64Array;
    this.status = epochs.column('status') as Uint8Array;
    const e = epochs.column('error_east_m');
    const n = epochs.column('error_north_m');
    this.horizontal = Float64Array.from(e, (value, i) => Math.hypot(value, n[i] ?? NaN));
  }

  get size(): number {
    return this.epochs.size;
  }
  /** The true track [m]. */
  get length(): number {
    let sum = 0;
    for (let i = 1; i < this.size; ++i) {
      sum += Math.hypot((this.east[i] ?? 0) - (this.east[i - 1] ?? 0), (this.north[i] ?? 0) - (this.north[i - 1] ?? 0));
    }
    return sum;
  }
  fixed(epoch: number): boolean {
    return this.status[epoch] === 1;
  }
  /** First and last epochs of the intervals without a fix. */
  losses(): [number, number][] {
    const found: [number, number][] = [];
    for (let i = 0; i < this.size; ++i) {
      const last = found.at(-1);
      if (this.fixed(i)) continue;
      if (last && last[1] === i - 1) last[1] = i;
      else found.push([i, i]);
    }
    return found;
  }
  /** The last epoch at or before a time [s]; the first one before all. */
  epochAt(seconds: number): number {
    let low = 0;
    let high = this.size - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if ((this.time[middle] ?? 0) <= seconds + 1e-9) low = middle;
      else high = middle - 1;
    }
    return low;
  }
  /** Elevations [deg] of the skyline at an epoch, from north clockwise; empty if unknown. */
  skyline(epoch: number): Float64Array {
    const { skylines } = this;
    if (!(skylines instanceof Rows)) return skylines[epoch] ?? new Float64Array();
    const row = this.epochs.at('skyline', epoch);
    if (!(row >= 0)) return new Float64Array();
    const all = skylines.column('elevation');
    const sectors = all.length / Math.max(1, skylines.size);
    return Float64Array.from(all.subarray(row * sectors, (row + 1) * sectors), (half) => half / 2);
  }
}

const kPathColumns = ['kind', 'order', 'excess_m', 'loss_db', 'phase_deg'] as const;
/** Its phase is relative to the line of sight, NaN if not in the view. */
export type PathRow = Record<(typeof kPathColumns)[number], number> & { point: Place | null; far: Place | null };

const kSatelliteColumns = ['satellite', 'azimuth_deg', 'elevation_deg', 'visibility', 'lock', 'cn0_dbhz', 'true_cn0_dbhz', 'excess_m',
  'pseudorange_error_m', 'residual_m', 'signal'] as const;
/** `signal`: index into words.signal, the first tracked by the receiver. */
export type SatelliteRow = Record<(typeof kSatelliteColumns)[number], number> &
  Record<'aboveMask' | 'used' | 'measured' | 'excluded', boolean> & { paths: PathRow[] };

const kBodyColumns = ['kind', 'east_m', 'north_m', 'low_m', 'high_m', 'yaw_deg', 'length_m', 'width_m'] as const;
/** An object near the antenna that is not in the city. */
export type BodyRow = Record<(typeof kBodyColumns)[number], number>;

/** The first row of each epoch of a block, and the end of the last. */
function beginsOf(rows: Rows, entry: ChunkEntry): Uint32Array {
  const epoch = rows.column('epoch');
  const begins = new Uint32Array(entry.epochs + 1).fill(rows.size);
  for (let row = rows.size - 1; row >= 0; --row) begins[(epoch[row] ?? 0) - entry.first_epoch] = row;
  for (let e = entry.epochs - 1; e >= 0; --e) {
    // An epoch without rows begins at the same row as the next one.
    begins[e] = Math.min(begins[e] ?? 0, begins[e + 1] ?? rows.size);
  }
  return begins;
}

export class Block {
  readonly satellites: Rows;
  readonly paths: Rows;
  private readonly bodies: Rows | undefined;  // missing in older views
  lastUse = 0;
  private readonly base: number;  // first epoch of the rows' numbering
  private readonly begins: Uint32Array;
  private readonly bodyBegins: Uint32Array;
  private readonly firstPath: Uint32Array;

  constructor(readonly entry: ChunkEntry, tables: Map<string, Rows>) {
    const [satellites, paths] = [tables.get('satellites'), tables.get('paths')];
    if (!satellites || !paths) throw new Error(`${entry.file} is not a block`);
    this.satellites = satellites;
    this.paths = paths;
    this.bodies = tables.get('bodies');
    this.base = entry.first_epoch;
    const count = satellites.column('paths');
    this.begins = beginsOf(satellites, entry);
    this.bodyBegins = this.bodies ? beginsOf(this.bodies, entry) : new Uint32Array(entry.epochs + 1);
    this.firstPath = new Uint32Array(satellites.size + 1);
    for (let row = 0; row < satellites.size; ++row) {
      this.firstPath[row + 1] = (this.firstPath[row] ?? 0) + (count[row] ?? 0);
    }
  }

  /** First row of an epoch, and one past its last. */
  range(epoch: number): [number, number] {
    const e = epoch - this.entry.first_epoch;
    return [this.begins[e] ?? 0, this.begins[e + 1] ?? 0];
  }

  /** The receiver's epoch of a row. */
  epochOf(row: number): number {
    return this.satellites.at('epoch', row) - this.base + this.entry.first_epoch;
  }

  row(row: number, withPaths: boolean): SatelliteRow {
    const flags = this.satellites.at('flags', row);
    return {
      ...this.satellites.row(kSatelliteColumns, row),
      aboveMask: (flags & 1) !== 0,
      used: (flags & 2) !== 0,
      measured: (flags & 4) !== 0,
      excluded: (flags & 8) !== 0,
      paths: withPaths ? this.pathsOf(row) : [],
    };
  }

  bodiesAt(epoch: number): BodyRow[] {
    const { bodies } = this;
    const e = epoch - this.entry.first_epoch;
    const result: BodyRow[] = [];
    for (let i = this.bodyBegins[e] ?? 0; bodies && i < (this.bodyBegins[e + 1] ?? 0); ++i) result.push(bodies.row(kBodyColumns, i));
    return result;
  }

  private pathsOf(row: number): PathRow[] {
    const p = this.paths;
    const result: PathRow[] = [];
    const place = (prefix: string, i: number): Place | null => {
      const east = p.at(`${prefix}_east_m`, i);
      return Number.isNaN(east) ? null : [east, p.at(`${prefix}_north_m`, i), p.at(`${prefix}_up_m`, i)];
    };
    for (let i = this.firstPath[row] ?? 0; i < (this.firstPath[row + 1] ?? 0); ++i) {
      result.push({ ...p.row(kPathColumns, i), point: place('point', i), far: place('far', i) });
    }
    return result;
  }
}

const kPlace = ['east_m', 'north_m', 'up_m'];

/** Epochs received as messages: the newest of a live receiver, or the one of an antenna put by the user. */
class History {
  readonly blocks: Block[] = [];
  private readonly columns = new Map<string, Values>();
  private readonly skylines: Float64Array[] = [];
  private begin = 0;
  private end = 0;

  /** @param keep number of stored epochs, the newest */
  constructor(private readonly header: Header, private readonly receiver: number, private readonly keep: number) {}

  get size(): number {
    return this.end - this.begin;
  }

  clear(): void {
    this.blocks.length = this.skylines.length = 0;
    this.begin = this.end = 0;
  }

  add(message: EpochMessage): void {
    const tables = tablesOf(message, this.header);
    const epoch = tables.get('epochs') as Rows;
    this.makeRoom();
    for (const column of this.header.tables.find((t) => t.name === 'epochs')?.columns ?? []) {
      const from = epoch.column(column.name);
      let all = this.columns.get(column.name);
      if (!all) this.columns.set(column.name, (all = new (from.constructor as new (n: number) => Values)(2 * this.keep)));
      all[this.end] = from[0] ?? NaN;
      // An unknown position stays the last known one.
      if (kPlace.includes(column.name) && Number.isNaN(all[this.end]) && this.size > 0) all[this.end] = all[this.end - 1] ?? NaN;
    }
    ++this.end;
    this.skylines.push(message.skyline ? Float64Array.from(message.skyline, (half) => half / 2)
      : this.skylines.at(-1) ?? new Float64Array());
    const block = new Block({ file: '', kind: 'block', receiver: this.receiver, first_epoch: 0, epochs: 1, satellites: 0, paths: 0, bytes: 0 }, tables);
    block.entry.first_epoch = this.size - 1;
    this.blocks.push(block);
  }

  track(): Track {
    const columns = new Map<string, Values>();
    for (const [name, values] of this.columns) columns.set(name, values.subarray(this.begin, this.end) as Values);
    return new Track(new Rows(this.size, columns), this.skylines);
  }

  /** Drops the oldest if the store is full; every `keep` epochs the rest moves to the front of the arrays. */
  private makeRoom(): void {
    if (this.size === this.keep) {
      ++this.begin;
      this.blocks.shift();
      this.skylines.shift();
      for (const block of this.blocks) --block.entry.first_epoch;
    }
    if (this.end < 2 * this.keep) return;
    for (const values of this.columns.values()) values.copyWithin(0, this.begin, this.end);
    this.end -= this.begin;
    this.begin = 0;
  }
}

export class Store {
  readonly tracks: Track[] = [];
  /** A validation has one row for each epoch. */
  comparison: Rows | null = null;
  private readonly blocks = new Map<string, Block>();
  private readonly pending = new Map<string, Promise<Block>>();
  private entries: ChunkEntry[][] = [];
  private readonly slices = new Map<string, Promise<Rows>>();
  /** Epochs received as messages, by receiver. */
  private readonly histories: (History | undefined)[] = [];
  private uses = 0;

  constructor(private readonly source: Source, readonly header: Header) {
    this.index();
  }

  private index(): void {
    this.entries = this.header.receivers.map((_, r) => this.header.chunks
      .filter((c): c is ChunkEntry => c.kind === 'block' && c.receiver === r).sort((a, b) => a.first_epoch - b.first_epoch));
  }

  /** Replaces the epochs received as messages by the complete run; keeps an antenna put by the user. */
  async adopt(): Promise<void> {
    const whole = new Store(this.source, await this.source.header());
    await whole.loadTracks();
    const put = this.header.receivers.slice(whole.tracks.length);
    Object.assign(this.header, whole.header);
    delete this.header.live;
    this.tracks.splice(0, whole.tracks.length, ...whole.tracks);
    this.histories.fill(undefined, 0, whole.tracks.length);
    this.index();
    this.header.receivers.push(...put);
  }

  /** All epochs of every receiver. */
  async loadTracks(): Promise<void> {
    for (let r = 0; r < this.header.receivers.length; ++r) {
      if (this.header.live || !this.header.chunks.some((c) => c.kind === 'track')) continue;
      const entry = this.header.chunks.find((c): c is ChunkEntry => c.kind === 'track' && c.receiver === r);
      if (!entry) throw new Error(`receiver ${r} has no track`);
      const tables = decodeChunk(await this.source.file(entry.file), this.header);
      const epochs = tables.get('epochs');
      const skylines = tables.get('skylines');
      if (!epochs || !skylines) throw new Error(`${entry.file} is not a track`);
      this.tracks.push(new Track(epochs, skylines));
    }
    const comparison = this.header.chunks.find((c) => c.kind === 'comparison');
    if (comparison) this.comparison = decodeChunk(await this.source.file(comparison.file), this.header).get('comparison') ?? null;
  }

  /** Takes an epoch received as a message. @param keep number of the receiver's stored epochs, the newest */
  append(receiver: number, message: EpochMessage, keep: number): void {
    const history = (this.histories[receiver] ??= new History(this.header, receiver, keep));
    const last = this.tracks[receiver]?.time.at(-1);
    // If time goes back, it is another run.
    if (keep === 1 || (last !== undefined && message.time_s < last)) history.clear();
    history.add(message);
    this.tracks[receiver] = history.track();
  }

  /** The kind of a fix; empty in views without it. */
  kind(receiver: number, epoch: number): string {
    const kinds = this.header.words.fix_kind;
    return kinds?.[this.tracks[receiver]?.epochs.at('fix_kind', epoch) ?? -1] ?? '';
  }
  /** Whether a receiver had corrections at some epoch. */
  corrected(receiver: number): boolean {
    const size = this.tracks[receiver]?.size ?? 0;
    for (let i = 0; i < size; ++i) {
      if (['differential', 'float', 'fixed'].includes(this.kind(receiver, i))) return true;
    }
    return false;
  }
  /** Names of the active faults; in views of earlier versions from the times in the header. */
  faults(receiver: number, epoch: number): string {
    const track = this.tracks[receiver];
    if (!track) return '';
    if (track.epochs.has('faults')) return this.header.words['faults']?.[track.epochs.at('faults', epoch)] ?? '';
    const now = track.time[epoch] ?? 0;
    return (this.header.receivers[receiver]?.faults ?? []).filter((f) => now >= f.from_s && now <= f.until_s).map((f) => f.name).join('; ');
  }

  /** Removes a receiver whose epochs were received as messages, the last of all. */
  drop(receiver: number): void {
    this.tracks.length = receiver;
    this.header.receivers.length = receiver;
  }

  /** First and last time of all receivers [s]. */
  get span(): [number, number] {
    const tracks = this.tracks.filter((t) => t.size > 0);
    if (tracks.length === 0) return [0, 1];
    const from = Math.min(...tracks.map((t) => t.time[0] ?? 0));
    return [from, Math.max(from + 1e-3, ...tracks.map((t) => t.time[t.size - 1] ?? 0))];
  }

  private entryOf(receiver: number, epoch: number): ChunkEntry | undefined {
    return this.entries[receiver]?.find((c) => epoch >= c.first_epoch && epoch < c.first_epoch + c.epochs);
  }

  /** The block of an epoch if it is loaded. */
  loaded(receiver: number, epoch: number): Block | undefined {
    const history = this.histories[receiver];
    if (history) return history.blocks[epoch];
    const entry = this.entryOf(receiver, epoch);
    const block = entry && this.blocks.get(entry.file);
    if (block) block.lastUse = ++this.uses;
    return block;
  }

  /** All loaded blocks of a receiver in order of time. */
  loadedBlocks(receiver: number): Block[] {
    const history = this.histories[receiver];
    if (history) return [...history.blocks];
    return [...this.blocks.values()]
      .filter((b) => b.entry.receiver === receiver)
      .sort((a, b) => a.entry.first_epoch - b.entry.first_epoch);
  }

  /** The block of an epoch; undefined: not in the run. */
  async load(receiver: number, epoch: number): Promise<Block | undefined> {
    const entry = this.entryOf(receiver, epoch);
    if (!entry) return undefined;
    const there = this.loaded(receiver, epoch);
    if (there) return there;
    let pending = this.pending.get(entry.file);
    if (!pending) {
      pending = this.fetchBlock(entry);
      this.pending.set(entry.file, pending);
    }
    return pending;
  }

  private async fetchBlock(entry: ChunkEntry): Promise<Block> {
    try {
      const tables = decodeChunk(await this.source.file(entry.file), this.header);
      const block = new Block(entry, tables);
      block.lastUse = ++this.uses;
      this.blocks.set(entry.file, block);
      this.dropOldest();
      return block;
    } finally {
      this.pending.delete(entry.file);
    }
  }

  private dropOldest(): void {
    const bytes = (): number => [...this.blocks.values()].reduce((sum, b) => sum + b.entry.bytes, 0);
    while (this.blocks.size > 2 && bytes() > kMostBlockBytes) {
      let oldest: Block | undefined;
      for (const b of this.blocks.values()) if (!oldest || b.lastUse < oldest.lastUse) oldest = b;
      if (oldest) this.blocks.delete(oldest.entry.file);
    }
  }

  /** A column of a satellite over a receiver's epochs; NaN: no value, or block not loaded. */
  ofSatellite(receiver: number, satellite: number, column: (typeof kSatelliteColumns)[number]): Float64Array {
    const result = new Float64Array(this.tracks[receiver]?.size ?? 0).fill(NaN);
    for (const block of this.loadedBlocks(receiver)) {
      const which = block.satellites.column('satellite');
      for (let row = 0; row < block.satellites.size; ++row) {
        if (which[row] !== satellite) continue;
        result[block.epochOf(row)] = block.satellites.at(column, row);
      }
    }
    return result;
  }

  /** Epochs where recorded and simulated pseudoranges differ most: one per street, the largest first. */
  differences(): number[] {
    const track = this.tracks[this.header.comparison?.recorded ?? 0];
    const difference = this.comparison?.column('difference_rms_m');
    if (!track || !difference) return [];
    const streets = this.header.comparison?.streets ?? [];
    const stretches = streets.length > 0 ? streets : [{ from_s: -Infinity, until_s: Infinity }];
    const largest = stretches.map((street) => {
      let best = -1;
      for (let i = 0; i < track.size; ++i) {
        const t = track.time[i] ?? 0;
        if (t < street.from_s || t > street.until_s || !((difference[i] ?? NaN) > (best < 0 ? -1 : difference[best] ?? 0))) continue;
        best = i;
      }
      return best;
    });
    return largest.filter((i) => i >= 0).sort((a, b) => (difference[b] ?? 0) - (difference[a] ?? 0));
  }

  /** Loads the blocks around an epoch, nearest first, as many as fit into their memory. */
  async loadAround(receiver: number, epoch: number, onBlock: () => void): Promise<void> {
    const entries = [...(this.entries[receiver] ?? [])];
    entries.sort((a, b) => Math.abs(a.first_epoch - epoch) - Math.abs(b.first_epoch - epoch));
    let bytes = 0;
    for (const entry of entries) {
      bytes += entry.bytes;
      if (bytes > kMostBlockBytes / Math.max(1, this.header.receivers.length)) return;
      if (this.blocks.has(entry.file)) continue;
      await this.load(receiver, entry.first_epoch);
      onBlock();
      // The page stays responsive between blocks.
      await new Promise((resolve) => setTimeout(resolve));
    }
  }

  /** The heat map's cells of an altitude. */
  mapCells(altitude: number): Promise<Rows> {
    return this.slice('map_cells', (c) => c.kind === 'map-cells' && c.altitude === altitude);
  }
  /** The heat map's values of an altitude at a time, layer by layer. */
  mapValues(altitude: number, time: number): Promise<Rows> {
    return this.slice('map_values', (c) => c.kind === 'map-values' && c.altitude === altitude && c.time === time);
  }

  private slice(table: string, wanted: (c: MapChunkEntry) => boolean): Promise<Rows> {
    const entry = this.header.chunks.find((c): c is MapChunkEntry => 'altitude' in c && wanted(c));
    if (!entry) throw new Error('the heat map has no such part');
    let there = this.slices.get(entry.file);
    if (!there) {
      there = this.source.file(entry.file).then((bytes) => {
        const rows = decodeChunk(bytes, this.header).get(table);
        if (!rows) throw new Error(`${entry.file} is not a part of a heat map`);
        return rows;
      });
      this.slices.set(entry.file, there);
      // Drops the oldest; shown slices are referenced by their users.
      if (this.slices.size > kMostSlices) this.slices.delete(this.slices.keys().next().value ?? '');
    }
    return there;
  }

  async city(): Promise<ArrayBuffer> {
    return this.source.file(this.header.city.file);
  }

  /** Bodies near the antenna at an epoch; empty while its block is not loaded. */
  bodies(receiver: number, epoch: number): BodyRow[] {
    return this.loaded(receiver, epoch)?.bodiesAt(epoch) ?? [];
  }

  /** Satellites at an epoch; empty while its block is not loaded. */
  satellites(receiver: number, epoch: number, withPaths = true): SatelliteRow[] {
    const block = this.loaded(receiver, epoch);
    if (!block) return [];
    const [begin, end] = block.range(epoch);
    const result: SatelliteRow[] = [];
    for (let row = begin; row < end; ++row) result.push(block.row(row, withPaths));
    return result;
  }
}
