// The engine's files on the page: numbers equal those of the CSV files of the same scenario. CANYON names the program
// (default: ../build-release/bin/canyon); without it these tests are skipped with a message.
import Ajv from 'ajv';
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { existsSync } from 'node:fs';
import { mkdtemp, readFile, rm, stat, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { kPatience, Session, withoutChromium } from './browser.mjs';
import { csv, program, root, withoutProgram } from './program.mjs';

const skip = withoutChromium || withoutProgram;
const seconds = '60';
let folder;
let s;
let epochs;
let satellites;

before(async () => {
  if (skip) return;
  folder = await mkdtemp(join(tmpdir(), 'canyon-engine-'));
  const scenario = join(folder, 'drive.yaml');
  await writeFile(scenario, `${await readFile(join(root, 'examples/synthetic_drive.yaml'), 'utf8')}\nstreets: {enabled: true, region: east_asia}\nfaults:\n`
    + '  - {name: dark, from_s: 20, until_s: 30, outage: {satellites: Galileo}}\n  - {name: deaf, from_s: 22, until_s: 28, clock: {jump_s: 1e-4}}\n');
  execFileSync(program, ['simulate', scenario, '--duration', seconds, '--out', folder, '--view', '--quiet'], { stdio: 'inherit', timeout: kPatience });
  execFileSync(program, ['view', folder, '--export', join(folder, 'scene.html'), '--quiet'], { stdio: 'inherit', timeout: kPatience });
  epochs = await csv(join(folder, 'epochs.csv'));
  satellites = await csv(join(folder, 'satellites.csv'));
  s = await Session.open(join(folder, 'scene.html'));
  await s.run(async () => {
    for (let e = 0; e < canyon.store.tracks[0].size; e += 64) await canyon.store.load(0, e);
  });
});
after(async () => {
  await s?.close();
  if (folder) await rm(folder, { recursive: true, force: true });
});

test('the header is what the schema says', { skip }, async () => {
  const schema = JSON.parse(await readFile(join(root, 'viewer/schema.json'), 'utf8'));
  const validate = new Ajv({ allowUnionTypes: true }).compile(schema);
  const header = JSON.parse(await readFile(join(folder, 'view/view.json'), 'utf8'));
  assert.ok(validate(header), JSON.stringify(validate.errors));
  assert.equal(header.receivers[0].summary.epochs, epochs.length);
});

test('opens from disk: no complaint, no request, below 5 MB', { skip }, async () => {
  assert.deepEqual(s.complaints, []);
  assert.deepEqual(s.foreignRequests(), []);
  assert.ok((await stat(join(folder, 'scene.html'))).size < 5e6);
});

test('every epoch has the numbers of epochs.csv', { skip }, async () => {
  const names = (await s.run(() => canyon.store.header.tables[0].columns.filter((c) => !canyon.store.header.words[c.name]).map((c) => c.name)))
    .filter((name) => name in epochs[0]);
  assert.ok(names.length > 12 && names.includes('hdop'), names.join());
  const columns = await s.run((list) => list.map((n) => Array.from(canyon.store.tracks[0].epochs.column(n), String)), names);
  const time = await s.run(() => Array.from(canyon.store.tracks[0].time));
  assert.equal(time.length, epochs.length);
  epochs.forEach((row, i) => {
    assert.ok(Math.abs(time[i] - (Number(row.gps_tow) - Number(epochs[0].gps_tow))) < 1e-9);
    names.forEach((n, k) => {
      if (row[n] === '') return assert.equal(columns[k][i], 'NaN', `${n} at epoch ${i}`);
      const digits = row[n].split('.')[1]?.length ?? 0;
      // The file rounds; a tie may be rounded up or down.
      assert.ok(Math.abs(Number(columns[k][i]) - Number(row[n])) <= 0.5000001 * 10 ** -digits, `${n} at epoch ${i}`);
    });
  });
});

test('the faults at work are those of epochs.csv', { skip }, async () => {
  const shown = await s.run(() => Array.from(canyon.store.tracks[0].time, (_t, i) => canyon.store.faults(0, i)));
  assert.deepEqual(shown, epochs.map((row) => row.faults));
  assert.ok(shown.includes('dark; deaf') && shown.includes(''));
  await s.run(() => canyon.goTo(25));
  assert.equal(await s.text('#readout [data-name="faults"]'), 'dark; deaf');
  await s.page.click('#tabs [data-tab=epoch]');
  assert.equal(await s.text('#tab-epoch [data-name="faults"]'), 'dark; deaf');
  await s.page.click('#tabs [data-tab=satellites]');
});

test('every satellite has the numbers of satellites.csv', { skip }, async () => {
  const rows = await s.run(() => {
    const { store } = canyon;
    const result = [];
    for (let e = 0; e < store.tracks[0].size; ++e) {
      for (const r of store.satellites(0, e, false)) {
        result.push([store.header.satellites[r.satellite].id, r.azimuth_deg, r.elevation_deg, store.header.words.visibility[r.visibility],
          r.used ? '1' : '0', store.header.words.lock[r.lock], String(r.cn0_dbhz), String(r.true_cn0_dbhz), String(r.excess_m), String(r.pseudorange_error_m),
          String(r.residual_m)]);
      }
    }
    return result;
  });
  assert.equal(rows.length, satellites.length);
  // Single precision: 6e-8 of the value, plus half a digit of the file.
  const near = (shown, cell, digits) => (cell === '' ? shown === 'NaN'
    : Math.abs(Number(shown) - Number(cell)) <= 0.51 * 10 ** -digits + 1.2e-7 * Math.abs(Number(cell)));
  rows.forEach(([id, azimuth, elevation, visibility, used, lock, cn0, trueCn0, excess, error, residual], i) => {
    const row = satellites[i];
    const where = `${row.sat} in row ${i}`;
    assert.equal(id, row.sat, where);
    assert.ok(Math.abs(((azimuth - Number(row.azimuth_deg) + 540) % 360) - 180) < 2e-5, where);
    assert.ok(Math.abs(elevation - Number(row.elevation_deg)) < 1e-5, where);
    assert.deepEqual([visibility, used, lock], [row.visibility, row.used, row.lock], where);
    assert.ok(near(cn0, row.cn0_dbhz, 2) && near(trueCn0, row.true_cn0_dbhz, 2), `C/N0 of ${where}`);
    assert.ok(near(excess, row.excess_path_m, 4) && near(error, row.pseudorange_error_m, 4) && near(residual, row.residual_m, 4),
      `errors of ${where}`);
  });
});

const correlationProgram = join(dirname(program), 'correlation_csv');
const withoutCorrelation = existsSync(correlationProgram) ? false : `SKIPPED: no ${correlationProgram} (build with CANYON_BUILD_TESTS=ON)`;
test('correlation functions are those of the library', { skip: skip || withoutCorrelation }, async () => {
  const file = join(folder, 'correlation.csv');
  const satellite = satellites.find((r) => r.visibility === 'LOS+multipath' && r.sat.startsWith('G')).sat;
  await writeFile(file, execFileSync(correlationProgram, [join(folder, 'drive.yaml'), '--satellite', satellite, '--duration', seconds],
    { stdio: ['ignore', 'pipe', 'inherit'], timeout: kPatience, maxBuffer: 1e8 }));
  const instants = new Map();
  for (const row of await csv(file)) {
    if (!instants.has(row.time_s)) instants.set(row.time_s, []);
    instants.get(row.time_s).push(row);
  }
  await s.page.click('[data-chart=correlation]');
  await s.run((id) => canyon.state.selectSatellite(canyon.store.header.satellites.findIndex((each) => each.id === id)), satellite);
  let compared = 0;
  for (const [time, rows] of [...instants].filter((_, i) => i % 7 === 0)) {
    await s.run((t) => canyon.goTo(t), Number(time));
    const data = await s.run(() => canyon.chart.plot && canyon.chart.plot.data.slice(0, 2).map((values) => Array.from(values)));
    const magnitudes = rows.map((row) => Math.hypot(Number(row.in_phase), Number(row.quadrature)));
    const most = Math.max(...magnitudes);
    if (!data) assert.equal(most, 0, `at ${time} s`);
    // With an excess delay of more than a chip the page shows more than three chips.
    else if (Math.abs(data[0].at(-1) - Number(rows.at(-1).delay_m)) < 1e-3) {
      // Phases are rounded to a degree, and the weakest paths are omitted.
      rows.forEach((_, k) => assert.ok(Math.abs(data[1][k] - magnitudes[k]) < 0.03 * most, `at ${time} s, ${rows[k].delay_m} m`));
      ++compared;
    }
  }
  assert.ok(compared > 5, `${compared} instants`);
  await s.run('canyon.state.selectSatellite(null)');
  await s.page.click('[data-chart=error]');
  await s.page.click('#tabs [data-tab=satellites]');
});

test('what people read is what the file says', { skip }, async () => {
  for (const i of [0, Math.floor(epochs.length / 2), epochs.length - 1]) {
    await s.run((seconds) => canyon.goTo(seconds), Number(epochs[i].gps_tow) - Number(epochs[0].gps_tow));
    const row = epochs[i];
    for (const n of ['error_east_m', 'error_north_m', 'error_up_m']) {
      const shown = (await s.text(`#readout [data-name="${n}"]`)).split(' ')[0];
      if (row[n] === '') assert.equal(shown, '–');
      else assert.ok(Math.abs(Number(shown) - Number(row[n])) <= 0.0051, `${n}: ${shown}, ${row[n]}`);
    }
    const ids = await s.page.locator('tr[data-satellite] th').allInnerTexts();
    assert.deepEqual(ids, satellites.filter((r) => r.gps_tow === row.gps_tow).map((r) => r.sat));
  }
});

test('traffic and what stands in the street is about the antenna', { skip }, async () => {
  const seen = await s.run(() => {
    const { store } = canyon;
    const track = store.tracks[0];
    const { body } = store.header.words;
    const result = [];
    for (let e = 0; e < track.size; ++e) {
      for (const b of store.bodies(0, e)) {
        result.push({ kind: body[b.kind], far: Math.hypot(b.east_m - track.east[e], b.north_m - track.north[e]), high: b.high_m - b.low_m, length: b.length_m });
      }
    }
    return result;
  });
  // docs/shadowing.md: 50 m along the road, and across it at most both lanes and pavements; classes of vehicles by their lengths and heights.
  assert.ok(seen.every((b) => b.far < Math.hypot(50, 30)), `${Math.max(...seen.map((b) => b.far))} m`);
  const vehicles = seen.filter((b) => b.kind === 'vehicle').map((b) => `${b.length.toFixed(1)} x ${b.high.toFixed(1)}`);
  const classes = ['4.5 x 1.5', '5.3 x 1.9', '5.9 x 2.4', '12.0 x 3.2', '12.0 x 4.4', '9.0 x 3.6'];
  assert.deepEqual([...new Set(vehicles)].filter((v) => !classes.includes(v)), []);
  assert.ok(vehicles.includes('4.5 x 1.5'));
  assert.deepEqual([...new Set(seen.map((b) => b.kind))].sort(), ['crown', 'structure', 'vehicle']);
});
