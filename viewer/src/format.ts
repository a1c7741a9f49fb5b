// The format "canyon view 1" (docs/view-format.md): types of the header, and chunks as typed arrays.

export interface Column {
  name: string;
  type: 'f64' | 'f32' | 'i32' | 'u32' | 'u16' | 'u8';
  unit: string;
  about?: string;
  values: number;
}

export interface CityObject {
  id: string;
  surface: 'building' | 'terrain' | 'foliage' | 'vehicle';
  material: string;
  low_m: number;
  high_m: number;
  height_source?: string;
}

/** Metrics of a run by name; null or absent: no value. */
export type Summary = { epochs: number } & Record<string, number | null | undefined>;

/** Display of a metric: its value times the factor is in the unit. */
export interface Figure {
  name: string;
  label: string;
  unit: string;
  factor: number;
  decimals: number;
  about: string;
}

export interface Receiver {
  name: string;
  strength: boolean;
  elevation_mask_deg: number;
  faults: { name: string; from_s: number; until_s: number }[];
  summary: Summary | null;
}

/** A receiver's file: all its epochs, or satellites and paths of a block of epochs. */
export interface ChunkEntry {
  file: string;
  kind: 'track' | 'block';
  receiver: number;
  first_epoch: number;
  epochs: number;
  satellites: number;
  paths: number;
  bytes: number;
}
/** A heat map's file: cells of an altitude, or values of an altitude and a time. */
export type MapChunkEntry = { file: string; bytes: number; altitude: number } & (
  { kind: 'map-cells' } | { kind: 'map-values'; time: number });

/** A validation's file: the differences of recorded and simulated at each epoch. */
export interface ComparisonChunkEntry { file: string; bytes: number; kind: 'comparison' }

/** Two receivers of the view to compare, and the streets of the drive. */
export interface Comparison {
  recorded: number;
  simulated: number;
  streets: { from_s: number; until_s: number; length_m: number; heading_deg: number }[];
}

export interface MapLayer {
  name: string;
  title: string;
  unit: string;
  /** Values times this factor are in the unit. */
  factor: number;
  decimals: number;
  low: number;
  high: number;
  progression: 'linear' | 'square root' | 'logarithm';
  /** Number of steps of a count; 0: continuous. */
  classes: number;
  colours: string;
  large_is_bad: boolean;
}

export interface MapHeader {
  name: string;
  grid: { west_m: number; south_m: number; spacing_m: number; columns: number; rows: number };
  altitudes_m: number[];
  altitude_above: 'terrain' | 'ellipsoid';
  times_utc: string[];
  layers: MapLayer[];
  states: string[];
  colours: Record<string, string[]>;
}

/** The correlation function of a signal: values from zero delay to one chip, linear between them. */
export interface Code {
  system: string;
  signal: string;
  chip_m: number;
  values: number[];
}

/** Texts of indices in columns, by the column's name. */
export type Words = Record<string, string[] | undefined>;

export interface Header {
  format: string;
  version: number;
  title: string;
  frame: { axes: string; unit: string; origin: { latitude_deg: number; longitude_deg: number; height_m: number } };
  time: { begin_utc: string; begin_gpst: string; gps_week: number; gps_tow: number; interval_s: number } | null;
  city: { name: string; file: string; triangles: number; notes: string[]; objects: CityObject[] };
  words: { status: string[]; placement: string[]; visibility: string[]; lock: string[]; path: string[]; body?: string[] } & Words;
  paths_per_satellite: number;
  /** Missing in views of earlier versions. */
  figures?: Figure[];
  receivers: Receiver[];
  satellites: { id: string; system: string }[];
  codes?: Code[];
  tables: { name: string; columns: Column[] }[];
  map?: MapHeader;
  comparison?: Comparison;
  chunks: (ChunkEntry | MapChunkEntry | ComparisonChunkEntry)[];
  /** Epochs are sent as messages. */
  live?: boolean;
}

export type Values = Float64Array | Float32Array | Int32Array | Uint32Array | Uint16Array | Uint8Array;

/** Rows of one table: a typed array for each column. */
export class Rows {
  constructor(readonly size: number, private readonly columns: Map<string, Values>) {}

  /** A whole column; throws for a name that is not in the file. */
  column(name: string): Values {
    const values = this.columns.get(name);
    if (!values) throw new Error(`no column ${name}`);
    return values;
  }

  has(name: string): boolean {
    return this.columns.has(name);
  }

  at(name: string, row: number): number {
    return this.column(name)[row] ?? NaN;
  }

  /** Values of a row by the names of their columns; NaN if the file has no such column. */
  row<Name extends string>(names: readonly Name[], row: number): Record<Name, number> {
    const values = {} as Record<Name, number>;
    for (const name of names) values[name] = this.columns.get(name)?.[row] ?? NaN;
    return values;
  }
}

const kTypes = {
  f64: Float64Array,
  f32: Float32Array,
  i32: Int32Array,
  u32: Uint32Array,
  u16: Uint16Array,
  u8: Uint8Array,
} as const;

/** Parses a chunk without copying. Typed arrays are little-endian on all machines with browsers. */
export function decodeChunk(buffer: ArrayBuffer, header: Header): Map<string, Rows> {
  const view = new DataView(buffer);
  const magic = new TextDecoder().decode(new Uint8Array(buffer, 0, 8));
  if (magic !== 'canyonV1') throw new Error('this is not a chunk of "canyon view 1"');
  const count = view.getUint32(8, true);
  let offset = 16 + 8 * count;
  const result = new Map<string, Rows>();
  for (let i = 0; i < count; ++i) {
    const table = header.tables[view.getUint32(16 + 8 * i, true)];
    const rows = view.getUint32(20 + 8 * i, true);
    if (!table) throw new Error('a chunk has a table that the header does not name');
    const columns = new Map<string, Values>();
    for (const column of table.columns) {
      offset = Math.ceil(offset / 8) * 8;
      const values = new kTypes[column.type](buffer, offset, rows * column.values);
      columns.set(column.name, values);
      offset += values.byteLength;
    }
    result.set(table.name, new Rows(rows, columns));
  }
  return result;
}

/** Unpacks gzip. @param name of the file, for the message about a damaged file */
export async function gunzip(bytes: Uint8Array<ArrayBuffer>, name: string): Promise<ArrayBuffer> {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Response(stream).arrayBuffer().catch(() => {
    throw new Error(`${name} is damaged: make the view again with “canyon view” or “canyon simulate --view”.`);
  });
}

/** Bytes of base64. */
export function unpacked(text: string): Uint8Array<ArrayBuffer> {
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; ++i) bytes[i] = letters.charCodeAt(i);
  return bytes;
}

/** The source of a view: the page itself, or its server. */
export interface Source {
  /** Whether a running `canyon` accepts requests. */
  readonly served: boolean;
  header(): Promise<Header>;
  file(name: string): Promise<ArrayBuffer>;
}

class EmbeddedSource implements Source {
  readonly served = false;

  async header(): Promise<Header> {
    return JSON.parse(document.getElementById('canyon-view')?.textContent ?? 'null') as Header;
  }

  async file(name: string): Promise<ArrayBuffer> {
    const script = document.querySelector(`script[data-canyon-file="${CSS.escape(name)}"]`);
    if (!script) throw new Error(`${name} is not in this page`);
    return gunzip(unpacked(script.textContent ?? ''), name);
  }
}

class ServedSource implements Source {
  readonly served = true;

  private async get(name: string): Promise<Response> {
    const response = await fetch(`view/${name}`);
    if (!response.ok) throw new Error(`${name}: ${response.status} ${response.statusText}`);
    return response;
  }

  async header(): Promise<Header> {
    return (await (await this.get('view.json')).json()) as Header;
  }

  async file(name: string): Promise<ArrayBuffer> {
    return gunzip(new Uint8Array(await (await this.get(name)).arrayBuffer()), name);
  }
}

export function openSource(): Source {
  return document.getElementById('canyon-view') ? new EmbeddedSource() : new ServedSource();
}

/** Throws, with a readable message, if a header is of another format or version. */
export function checkHeader(header: Header | null): asserts header is Header {
  if (!header || header.format !== 'canyon view') throw new Error('This page has no data of Canyon.');
  if (header.version !== 1) {
    throw new Error(`The data have version ${header.version} of the format; this viewer reads version 1.`);
  }
}
