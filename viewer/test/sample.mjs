// A synthetic view with numbers that can be computed by hand: a block of boxes, a drive along a street, twelve satellites.
// It is for tests of the page without a built engine; the engine's output is also tested by page.test.mjs.
import { gzipSync } from 'node:zlib';

const kSizes = { f64: 8, f32: 4, i32: 4, u32: 4, u16: 2, u8: 1 };
const kPut = { f64: 'setFloat64', f32: 'setFloat32', i32: 'setInt32', u32: 'setUint32', u16: 'setUint16', u8: 'setUint8' };

const column = (name, type = 'f64', values = 1) => ({ name, type, unit: '', values });
export const kTables = [
  { name: 'epochs', columns: [
    ...['time_s', 'east_m', 'north_m', 'up_m', 'yaw_deg', 'roll_deg', 'pitch_deg', 'velocity_east_mps', 'velocity_north_mps', 'velocity_up_mps'].map((n) => column(n)),
    column('status', 'u8'), column('placement', 'u8'),
    ...['fix_east_m', 'fix_north_m', 'fix_up_m', 'error_east_m', 'error_north_m', 'error_up_m', 'covariance_east_m2', 'covariance_north_m2',
      'covariance_up_m2', 'covariance_east_north_m2', 'covariance_east_up_m2', 'covariance_north_up_m2', 'gdop', 'pdop', 'hdop', 'vdop',
      'tdop'].map((n) => column(n)),
    column('used', 'u16'), column('tracked', 'u16'), column('not_tracked', 'u16'), column('skyline', 'i32')] },
  { name: 'skylines', columns: [column('elevation', 'u8', 120)] },
  { name: 'satellites', columns: [column('epoch', 'u32'), column('satellite', 'u16'), column('azimuth_deg', 'f32'),
    column('elevation_deg', 'f32'), column('visibility', 'u8'), column('flags', 'u8'), column('lock', 'u8'),
    ...['cn0_dbhz', 'true_cn0_dbhz', 'excess_m', 'pseudorange_error_m', 'residual_m'].map((n) => column(n, 'f32')), column('paths', 'u16'), column('signal', 'u8')] },
  { name: 'paths', columns: [column('kind', 'u8'), column('order', 'u8'), ...['excess_m', 'loss_db', 'phase_deg', 'point_east_m', 'point_north_m',
    'point_up_m', 'far_east_m', 'far_north_m', 'far_up_m'].map((n) => column(n, 'f32'))] },
  { name: 'map_cells', columns: [column('state', 'u8'), column('up_m', 'f32')] },
  { name: 'map_values', columns: [column('value', 'f32')] },
  { name: 'comparison', columns: [...['recorded_rms_m', 'simulated_rms_m', 'difference_rms_m'].map((n) => column(n, 'f32')), column('both', 'u16')] },
  { name: 'bodies', columns: [column('epoch', 'u32'), column('kind', 'u8'), ...['east_m', 'north_m', 'low_m', 'high_m', 'yaw_deg', 'length_m',
    'width_m'].map((n) => column(n, 'f32'))] },
];

/** The bytes of a chunk; rows: one array of rows (arrays of values) for each table, by its index. */
export function encodeChunk(tables) {
  const parts = [];
  let size = 16 + 8 * tables.length;
  for (const [index, rows] of tables) {
    kTables[index].columns.forEach((c, k) => {
      size = Math.ceil(size / 8) * 8;
      parts.push({ at: size, type: c.type, values: c.values > 1 ? rows.flat() : rows.map((r) => r[k]) });
      size += rows.length * c.values * kSizes[c.type];
    });
  }
  const bytes = Buffer.alloc(Math.ceil(size / 8) * 8);
  bytes.write('canyonV1', 'latin1');
  const view = new DataView(bytes.buffer, bytes.byteOffset);
  view.setUint32(8, tables.length, true);
  tables.forEach(([index, rows], i) => {
    view.setUint32(16 + 8 * i, index, true);
    view.setUint32(20 + 8 * i, rows.length, true);
  });
  for (const p of parts) p.values.forEach((v, i) => view[kPut[p.type]](p.at + i * kSizes[p.type], v, true));
  return bytes;
}

/** Boxes [id, low east, low north, high east, high north, height] as glTF binary. */
function glb(boxes) {
  const positions = [];
  const indices = [];
  const gltf = { asset: { version: '2.0' }, nodes: [{ name: 'city' }], meshes: [], accessors: [], bufferViews: [], materials: [{ name: 'concrete' }] };
  for (const [, w, s, e, n, h] of boxes) {
    const first = positions.length / 3;
    const corners = [];
    for (const [x, y] of [[w, s], [e, s], [e, n], [w, n]]) for (const z of [0, h]) corners.push([x, z, -y]);
    positions.push(...corners.flat());
    const faces = [[1, 3, 5], [1, 5, 7]];
    for (let k = 0; k < 4; ++k) {
      const a = 2 * k;
      const b = (2 * k + 2) % 8;
      faces.push([a, b, b + 1], [a, b + 1, a + 1]);
    }
    gltf.accessors.push({ bufferView: 0, byteOffset: 12 * first, componentType: 5126, count: 8, type: 'VEC3' },
      { bufferView: 1, byteOffset: 4 * indices.length, componentType: 5125, count: 30, type: 'SCALAR' });
    indices.push(...faces.flat());
    gltf.meshes.push({ primitives: [{ attributes: { POSITION: gltf.accessors.length - 2 }, indices: gltf.accessors.length - 1, material: 0 }] });
    gltf.nodes.push({ mesh: gltf.meshes.length - 1 });
  }
  gltf.bufferViews.push({ buffer: 0, byteOffset: 0, byteLength: 4 * positions.length },
    { buffer: 0, byteOffset: 4 * positions.length, byteLength: 4 * indices.length });
  let json = JSON.stringify(gltf);
  json += ' '.repeat((4 - (json.length % 4)) % 4);
  const binary = Buffer.concat([Buffer.from(new Float32Array(positions).buffer), Buffer.from(new Uint32Array(indices).buffer)]);
  const head = Buffer.alloc(20);
  head.write('glTF', 'latin1');
  head.writeUInt32LE(2, 4);
  head.writeUInt32LE(28 + json.length + binary.length, 8);
  head.writeUInt32LE(json.length, 12);
  head.write('JSON', 16, 'latin1');
  const middle = Buffer.alloc(8);
  middle.writeUInt32LE(binary.length, 0);
  middle.write('BIN\0', 4, 'latin1');
  return Buffer.concat([head, Buffer.from(json), middle, binary]);
}

/** A view: its header and its files. @param grid buildings in a row; @param epochs `interval` seconds apart @param more satellites */
export function sampleView({ grid = 8, epochs = 120, block = 40, interval = 1, more = 0 } = {}) {
  const boxes = [];
  for (let i = 0; i < grid * grid; ++i) {
    const w = 76 * ((i % grid) - grid / 2) + 8;
    const s = 76 * (Math.floor(i / grid) - grid / 2) + 8;
    boxes.push([`block ${i + 1}`, w, s, w + 60, s + 60, 12 + ((i * 37) % 90)]);
  }
  const satellites = ['G01', 'G05', 'G12', 'G17', 'G24', 'G30', 'E02', 'E07', 'E11', 'E19', 'E30', 'E36',
    ...Array.from({ length: more }, (_, i) => `C${String(i + 1).padStart(2, '0')}`)];
  const rows = [];
  const blocks = [];
  for (let e = 0; e < epochs; ++e) {
    const lost = e >= 50 && e < 60;
    const east = -228 + 4 * ((e * interval) % 120);
    // Error: e/10 m east, e/20 m north, 1 m up; maximum at the last epoch.
    const error = lost ? [NaN, NaN, NaN] : [e / 10, e / 20, 1];
    const covariance = lost ? Array(6).fill(NaN) : [9, 4, 16, 2, 0, 0];
    rows.push([e * interval, east, 0, 1.5, 0, 0, 0, 4, 0, 0, lost ? 2 : 1, 0, east + error[0], error[1], 1.5 + error[2], ...error, ...covariance,
      ...(lost ? Array(5).fill(NaN) : [2.5, 2.1, 1.25, 1.7, 1.3]), lost ? 0 : 9, lost ? 3 : 9, lost ? 9 : 3, 0]);
    if (e % block === 0) blocks.push({ first: e, satellites: [], paths: [], bodies: [] });
    const b = blocks.at(-1);
    // A bus north of the antenna, across its street, and, at every second epoch, a tree.
    b.bodies.push([e, 0, east, 8, 0, 3, 90, 12, 2.5]);
    if (e % 2 === 1) b.bodies.push([e, 2, east, -8, 3, 7, 0, 4, 4]);
    satellites.forEach((_, s) => {
      const azimuth = (30 * s + e / 60) % 360;
      const elevation = 15 + ((s * 29) % 70);
      const visibility = s % 4;
      const paths = [];
      if (visibility < 2) paths.push([0, 0, 0, 0, 0, NaN, NaN, NaN, NaN, NaN, NaN]);
      if (visibility === 1 || visibility === 2) paths.push([1, 1, 12.5, 6, 0, east + 5, 8, 12, NaN, NaN, NaN]);
      if (visibility === 2) paths.push([1, 2, 30, 14, 180, east + 9, 8, 9, east + 3, -8, 20]);
      const seen = visibility < 3;
      b.satellites.push([e, s, azimuth, elevation, visibility, 1 | (seen && !lost ? 2 : 0) | (seen ? 4 : 0), seen ? 1 : 0,
        seen ? 45 - 4 * visibility : NaN, seen ? 45.5 - 4 * visibility : NaN, seen ? 5 * visibility : NaN, seen ? 5 * visibility + 0.25 : NaN,
        seen && !lost ? 0.5 : NaN, paths.length, satellites[s][0] === 'G' ? 1 : 2]);
      b.paths.push(...paths);
    });
  }
  const skyline = Array.from({ length: 120 }, (_, k) => 40 + Math.round(60 * Math.abs(Math.sin((k * 3 * Math.PI) / 90))));
  const files = new Map([['city.glb.gz', gzipSync(glb(boxes))]]);
  const chunks = [];
  const put = (file, entry, bytes) => {
    files.set(file, gzipSync(bytes));
    chunks.push({ file, receiver: 0, satellites: 0, paths: 0, ...entry, bytes: bytes.length });
  };
  for (const b of blocks) {
    put(`block-0-${String(b.first).padStart(5, '0')}.bin.gz`, { kind: 'block', first_epoch: b.first, epochs: Math.min(block, epochs - b.first),
      satellites: b.satellites.length, paths: b.paths.length }, encodeChunk([[2, b.satellites], [3, b.paths], [7, b.bodies]]));
  }
  put('track-0.bin.gz', { kind: 'track', first_epoch: 0, epochs }, encodeChunk([[0, rows], [1, [skyline]]]));
  const header = {
    format: 'canyon view', version: 1, title: 'sample </script> drive',
    frame: { axes: 'east north up', unit: 'm', origin: { latitude_deg: 22.3, longitude_deg: 114.17, height_m: 0 } },
    time: { begin_utc: '2026-06-01T08:00:00.000Z', begin_gpst: '2026-06-01T08:00:18.000 GPST', gps_week: 2421, gps_tow: 115218, interval_s: interval },
    city: { name: 'boxes', file: 'city.glb.gz', triangles: 10 * boxes.length, notes: ['made up'],
      objects: boxes.map(([id, , , , , h]) => ({ id, surface: 'building', material: 'concrete', low_m: 0, high_m: h, height_source: 'levels' })) },
    words: { status: ['not solved', 'fix', 'too few satellites'], placement: ['free'], visibility: ['LOS', 'LOS+multipath', 'NLOS', 'blocked'],
      lock: ['searching', 'tracking', 'holding'], path: ['direct', 'reflected', 'diffracted', 'diffuse', 'spoofed'],
      body: ['vehicle', 'structure', 'crown'], signal: ['', 'L1CA', 'E1'] },
    paths_per_satellite: 12,
    figures: [{ name: 'epochs', label: 'epochs', unit: '', factor: 1, decimals: 0, about: 'epochs' },
      { name: 'horizontal_p95_m', label: 'horizontal error, 95 %', unit: 'm', factor: 1, decimals: 3, about: '95 % of the horizontal error' },
      { name: 'los_share', label: 'LOS', unit: '%', factor: 100, decimals: 1, about: 'share in line of sight alone' }],
    receivers: [{ name: 'car', strength: true, elevation_mask_deg: 10, faults: [{ name: 'jammer', from_s: 48, until_s: 60 }],
      summary: { epochs, fixes: epochs - 10, horizontal_p50_m: 6.5, horizontal_p95_m: 12.5, horizontal_max_m: 13.3, vertical_p50_m: 1,
        vertical_p95_m: 1, median_hdop: 1.25, mean_used: 8.25, mean_tracked: 8.5, mean_not_tracked: 3.5, los_share: 0.25,
        los_multipath_share: 0.25, nlos_share: 0.25, blocked_share: 0.25, longest_outage_s: 10 } }],
    satellites: satellites.map((id) => ({ id, system: id[0] === 'G' ? 'GPS' : 'Galileo' })),
    codes: [{ system: 'GPS', signal: 'L1CA', chip_m: 293, values: [1, 0.5, 0] }],
    tables: kTables, chunks,
  };
  return { header, files };
}

/** The sample as a validation of three streets of 40 s: the receiver is the recorded one, the simulated one is a copy. The
 *  rms are e / 10, e / 5 and, the largest of each street at its end, 10, 30 and 20 times e mod 40 / 39. */
export function withPair({ header, files }) {
  const epochs = header.receivers[0].summary.epochs;
  const chunks = [...header.chunks];
  for (const chunk of header.chunks) {
    const file = chunk.file.replace('-0', '-1');
    files.set(file, files.get(chunk.file));
    chunks.push({ ...chunk, file, receiver: 1 });
  }
  const rows = Array.from({ length: epochs }, (_, e) => [e / 10, e / 5, ([10, 30, 20][Math.floor(e / 40)] * (e % 40)) / 39, 5]);
  const bytes = encodeChunk([[6, rows]]);
  files.set('comparison.bin.gz', gzipSync(bytes));
  chunks.push({ file: 'comparison.bin.gz', kind: 'comparison', bytes: bytes.length });
  const streets = [0, 40, 80].map((from) => ({ from_s: from, until_s: from + 39, length_m: 156, heading_deg: 90 }));
  return { header: { ...header, receivers: ['recorded', 'simulated'].map((name) => ({ ...header.receivers[0], name })),
    comparison: { recorded: 0, simulated: 1, streets }, chunks }, files };
}

/** Adds a heat map to a view: 40 x 20 cells of 10 m, 2 altitudes, 3 times, an error and a count. Row by row from the south-west
 *  corner the first five rows are inside a building; the error is column / 10 m, a step higher at each time; in the last row it
 *  has no value. */
export function withMap({ header, files }) {
  const [columns, rows] = [40, 20];
  const altitudes = [1.5, 50];
  const times = ['2026-06-01T08:00:00.000Z', '2026-06-01T09:00:00.000Z', '2026-06-01T10:00:00.000Z'];
  const chunks = [...header.chunks];
  const put = (file, entry, bytes) => {
    files.set(file, gzipSync(bytes));
    chunks.push({ file, ...entry, bytes: bytes.length });
  };
  const each = (value) => Array.from({ length: columns * rows }, (_, i) => value(i % columns, Math.floor(i / columns)));
  altitudes.forEach((up, a) => {
    put(`map-${a}.bin.gz`, { kind: 'map-cells', altitude: a }, encodeChunk([[4, each((_, row) => [row < 5 ? 1 : 0, up])]]));
    times.forEach((_, t) => put(`map-${a}-${t}.bin.gz`, { kind: 'map-values', altitude: a, time: t },
      encodeChunk([[5, [...each((c, row) => [row === rows - 1 ? NaN : c / 10 + t]), ...each((_, row) => [row])]]])));
  });
  const grey = (n) => Array.from({ length: n }, (_, i) => `#${Math.round((255 * i) / (n - 1)).toString(16).padStart(2, '0').repeat(3)}`);
  const map = {
    name: 'errors', grid: { west_m: -200, south_m: -100, spacing_m: 10, columns, rows }, altitudes_m: altitudes, altitude_above: 'terrain',
    times_utc: times,
    layers: [
      { name: 'horizontal_error', title: 'horizontal error', unit: 'm', factor: 1, decimals: 2, low: 0, high: 4, progression: 'linear',
        classes: 0, colours: 'grey', large_is_bad: false },
      { name: 'availability', title: 'availability', unit: '%', factor: 100, decimals: 2, low: 0, high: 20, progression: 'square root',
        classes: 0, colours: 'grey', large_is_bad: true }],
    states: ['computed', 'inside a building'], colours: { grey: grey(65), other: grey(65).reverse() },
  };
  return { header: { ...header, map, chunks }, files };
}

/** Puts a view into the viewer's page, like `canyon view --export`. */
export function fillPage(page, { header, files }) {
  const json = JSON.stringify(header).replaceAll('<', '\\u003c');
  let data = `<script type="application/json" id="canyon-view">${json}</script>\n`;
  for (const [name, bytes] of files) data += `<script type="text/plain" data-canyon-file="${name}">${bytes.toString('base64')}</script>\n`;
  return page.replace('<!--canyon:data-->', () => data);
}
