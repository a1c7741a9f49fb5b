// The page as served by `canyon view`: HTTP, the probe, live epochs. CANYON names the program (default:
// ../build-release/bin/canyon); without it these tests are skipped with a message.
import Ajv from 'ajv';
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { existsSync } from 'node:fs';
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Session, withoutChromium } from './browser.mjs';
import { csv, program, root, Running, withoutProgram } from './program.mjs';

const skip = withoutChromium || withoutProgram;
const messages = async () => {
  const schema = JSON.parse(await readFile(join(root, 'viewer/schema.json'), 'utf8'));
  return new Ajv({ allowUnionTypes: true }).compile({ ...schema.definitions.message, definitions: schema.definitions });
};
/** In the page: an antenna at the first receiver's position at epoch 12. */
const putAtEpoch12 = () => {
  const { canyon } = window;
  const t = canyon.store.tracks[0];
  canyon.goTo(t.time[12]);
  document.getElementById('probe-height').value = '0';
  canyon.probe.put([t.east[12], t.north[12], t.up[12]]);
};
let folder;
let server;
let s;
let rows;

before(async () => {
  if (skip) return;
  folder = await mkdtemp(join(tmpdir(), 'canyon-served-'));
  const scenario = join(root, 'examples/synthetic_drive.yaml');
  execFileSync(program, ['simulate', scenario, '--duration', '20', '--out', folder, '--quiet'], { stdio: 'inherit' });
  rows = await csv(join(folder, 'satellites.csv'));
  server = await Running.start(['view', scenario, '--duration', '20', '--quiet']);
  s = await Session.open(server.address);
  // A page may be loaded before the run's end: then it shows the newest epoch.
  await s.page.waitForFunction(() => !canyon.store.header.live && canyon.store.loaded(0, 0));
  await s.run('canyon.goTo(0)');
});
after(async () => {
  await s?.close();
  await server?.stop();
  if (folder) await rm(folder, { recursive: true, force: true });
});

test('opens from the server: no complaint, and nothing asked of anybody else', { skip }, async () => {
  assert.deepEqual(s.complaints, []);
  assert.ok(s.requests.length > 3, 'header, city and track come one by one');
  assert.deepEqual(s.requests.filter((url) => !url.startsWith(server.address) && !/^(data|blob):/.test(url)), []);
  await s.page.waitForFunction(() => canyon.store.satellites(0, 0).length > 5);
  assert.equal(await s.page.locator('tr[data-satellite]').count(), rows.filter((r) => r.gps_tow === rows[0].gps_tow).length);
});

test('an antenna where the receiver is has its sky', { skip }, async () => {
  // Epoch 12, with no height above the antenna's own position.
  await s.run(putAtEpoch12);
  await s.page.waitForFunction(() => canyon.state.receiver === 1);
  const shown = await s.run(() => canyon.store.satellites(1, 0).map((r) => [canyon.store.header.satellites[r.satellite].id,
    r.azimuth_deg, r.elevation_deg, canyon.store.header.words.visibility[r.visibility], r.paths.length]));
  const tows = [...new Set(rows.map((r) => r.gps_tow))];
  const expected = rows.filter((r) => r.gps_tow === tows[12]);
  assert.deepEqual(shown.map((r) => r[0]), expected.map((r) => r.sat));
  shown.forEach(([id, azimuth, elevation], i) => {
    assert.ok(Math.abs(((azimuth - Number(expected[i].azimuth_deg) + 540) % 360) - 180) < 2e-5, id);
    assert.ok(Math.abs(elevation - Number(expected[i].elevation_deg)) < 1e-5, id);
  });
  // Its paths are those of the drive, in all columns; heights near 0 have either sign.
  const paths = (receiver, epoch) => s.run(([r, e]) => canyon.store.satellites(r, e).map((row) => row.paths.map((p) =>
    [p.kind, p.order, p.excess_m, p.point?.map((x) => Math.round(x) + 0)])), [receiver, epoch]);
  assert.deepEqual(await paths(1, 0), await paths(0, 12));
  // The panels show it: table, sky plot's skyline, readout.
  assert.equal(await s.page.locator('tr[data-satellite]').count(), expected.length);
  assert.ok(await s.run(() => canyon.store.tracks[1].skyline(0).some((e) => e > 5)));
  assert.match(await s.text('#probe-where'), /east, north, up/);
  // The chart stays that of the drive.
  assert.equal(await s.run('canyon.chart.plot.data[0].length'), await s.run('canyon.store.tracks[0].size'));
  assert.equal(await s.run('canyon.chart.plot.series[1].label'), 'vertical error');
  assert.deepEqual(s.complaints, []);
});

test('goes with the time, one question after the other', { skip }, async () => {
  await s.page.keyboard.press('ArrowRight');
  await s.page.waitForFunction(() => canyon.store.tracks[1].time[0] === canyon.store.tracks[0].time[13]);
  await s.run(() => { for (let i = 0; i < 10; ++i) canyon.goTo(canyon.store.tracks[0].time[2 * i]); });
  await s.page.waitForFunction(() => canyon.store.tracks[1].time[0] === canyon.store.tracks[0].time[18]);
  await s.page.keyboard.press('Escape');
  assert.equal(await s.run('canyon.state.receiver'), 0);
  assert.equal(await s.run('canyon.store.tracks.length'), 1);
  assert.ok(await s.page.locator('#probe').isHidden());
});

test('Shift+click and P put an antenna above what is clicked', { skip }, async () => {
  await s.page.keyboard.press('3');  // from above
  const roof = await s.run(() => {
    const { canyon } = window;
    const index = canyon.store.header.city.objects.findIndex((o) => o.surface === 'building' && o.high_m > 10);
    document.getElementById('probe-height').value = '2';
    return canyon.store.header.city.objects[index].high_m;
  });
  const box = await s.page.locator('#stage').boundingBox();
  const click = () => s.page.mouse.click(box.x + box.width / 2 - 4, box.y + box.height / 2);
  await s.page.keyboard.press('p');
  assert.ok(await s.page.locator('#stage.putting').count());
  await click();
  await s.page.waitForFunction(() => canyon.state.receiver === 1);
  assert.equal(await s.page.locator('#stage.putting').count(), 0);
  // In the street under the vehicle: 2 m above the ground, which is flat.
  const up = await s.run(() => canyon.store.tracks[1].up[0]);
  assert.ok(Math.abs(up - 2) < 0.7, `${up} m`);
  const ms = await s.run('canyon.probe.answerMs');
  console.log(`probe of the demo: ${ms.toFixed(0)} ms from question to answer`);
  await s.page.click('#probe-end');
  // Above a building's roof.
  const place = await s.run(() => {
    const { canyon } = window;
    const o = canyon.scene.city.objects;
    const index = o.findIndex((b) => b.surface === 'building' && b.high_m > 10);
    // The middle of a triangle of its roof.
    for (const mesh of canyon.scene.city.group.children.filter((m) => m.isMesh)) {
      const at = mesh.geometry.attributes.position;
      const face = mesh.userData.objects.findIndex((of, f) => of === index && [0, 1, 2].every((k) => Math.abs(at.getZ(3 * f + k) - o[index].high_m) < 0.01));
      if (face < 0) continue;
      const mean = (get) => (at[get](3 * face) + at[get](3 * face + 1) + at[get](3 * face + 2)) / 3;
      canyon.scene.control.target.set(mean('getX'), mean('getY'), 0);
      canyon.state.camera = 'top';
      return [mean('getX'), mean('getY')];
    }
    return null;
  });
  await s.page.keyboard.down('Shift');
  await s.page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  await s.page.keyboard.up('Shift');
  await s.page.waitForFunction(() => canyon.state.receiver === 1);
  const above = await s.run(() => canyon.store.tracks[1].up[0]);
  assert.ok(Math.abs(above - roof - 2) < 0.1, `${above} m over ${place}, roof ${roof} m`);
  await s.page.keyboard.press('Escape');
  assert.deepEqual(s.complaints, []);
});

test('what is wrong with a question is said', { skip }, async () => {
  await s.run(() => window.canyon.probe.put([1e6, 0, 0]));
  await s.page.waitForFunction(() => document.getElementById('toast').classList.contains('shown'));
  assert.match(await s.text('#toast'), /'east_m' is 1000000; give a value from/);
  await s.page.keyboard.press('Escape');
});

test('messages are what the schema says', { skip }, async () => {
  const valid = await messages();
  const question = { type: 'probe', version: 1, id: 1, receiver: 0, time_s: 3, place: { east_m: 0, north_m: 0, up_m: 40 } };
  assert.ok(valid(question), JSON.stringify(valid.errors));
  const answers = await s.run(async (texts) => {
    const socket = new WebSocket(`ws://${location.host}/messages`);
    const got = [];
    await new Promise((resolve) => (socket.onmessage = (e) => got.push(JSON.parse(e.data)) === 2 && resolve()));
    for (const text of texts) {
      socket.send(text);
      got.push(await new Promise((resolve) => (socket.onmessage = (e) => resolve(JSON.parse(e.data)))));
    }
    socket.close();
    return got;
  }, [JSON.stringify(question), 'garbage', '{"type":"probe","version":1,"id":4,"time_s":1e999}']);
  assert.deepEqual(answers.map((a) => a.type), ['hello', 'finished', 'epoch', 'error', 'error']);
  for (const answer of answers) assert.ok(valid(answer), JSON.stringify(valid.errors));
  assert.equal(answers[2].skyline.length, 120);
});

test('an exported page says that it needs a running canyon', { skip }, async () => {
  const scenario = join(root, 'examples/synthetic_drive.yaml');
  const file = join(folder, 'scene.html');
  execFileSync(program, ['view', scenario, '--duration', '2', '--export', file, '--quiet'], { stdio: 'inherit' });
  const other = await Session.open(file);
  try {
    await other.page.keyboard.press('p');
    assert.match(await other.text('#toast'), /exported.*running “canyon view”/);
    assert.deepEqual(other.complaints, []);
  } finally {
    await other.close();
  }
});

test('antennas can be put in a finished run whose scenario is given', { skip }, async () => {
  const scenario = join(root, 'examples/synthetic_drive.yaml');
  const run = join(folder, 'run');
  execFileSync(program, ['view', scenario, '--duration', '3', '--out', run, '--quiet'], { stdio: 'inherit' });
  for (const given of [[], ['--city', scenario]]) {
    const finished = await Running.start(['view', run, ...given, '--quiet']);
    const page = await Session.open(finished.address);
    try {
      await page.page.waitForFunction(() => canyon.store.loaded(0, 0));
      await page.run(() => canyon.probe.put([0, 0, 0]));
      if (given.length) {
        await page.page.waitForFunction(() => canyon.state.receiver === 1 && canyon.store.satellites(1, 0).length > 5);
      } else {
        await page.page.waitForFunction(() => /no scenario for tracing.*--city SCENARIO/.test(document.getElementById('toast').textContent));
      }
      assert.deepEqual(page.complaints, []);
    } finally {
      await page.close();
      assert.equal(await finished.stop(), 0);
    }
  }
});

test('antennas can be put in a validation whose scenario is given', { skip }, async () => {
  // The drive of 20 s is the recording, judged by its own scenario.
  const drive = await readFile(join(root, 'examples/synthetic_drive.yaml'), 'utf8');
  const scenario = join(folder, 'judge.yaml');
  await writeFile(scenario, drive.replace('nominal: true', 'navigation: [sky.nav]'));
  const truth = (await readFile(join(folder, 'epochs.csv'), 'utf8')).trimEnd().split('\n').slice(1).map((line) => line.split(',', 5).join(','));
  await writeFile(join(folder, 'truth.csv'), `${truth.join('\n')}\n`);
  const report = join(folder, 'report');
  execFileSync(program, ['validate', scenario, '--obs', join(folder, 'receiver.obs'), '--truth', join(folder, 'truth.csv'), '--format', 'urbannav',
    '--no-atmosphere', '--view', report, '--quiet'], { stdio: 'inherit' });
  const other = join(folder, 'other.yaml');
  await writeFile(other, drive.replace('seed: 7', 'seed: 8'));
  assert.match(await Running.refused(['view', report, '--city', other]), /shows a validation in another city than the scenario's/);
  const judged = await Running.start(['view', report, '--city', scenario, '--quiet']);
  const page = await Session.open(judged.address);
  try {
    await page.page.waitForFunction(() => canyon.store.loaded(0, 0));
    await page.run(putAtEpoch12);
    await page.page.waitForFunction(() => canyon.state.receiver === 2);
    // For either selected side, the simulated receiver is put.
    assert.match(await page.run('canyon.store.header.receivers[2].name'), /put as simulated/);
    const seen = (receiver, epoch) => page.run(([r, e]) => canyon.store.satellites(r, e).map((row) =>
      ({ id: canyon.store.header.satellites[row.satellite].id, direct: row.paths.some((p) => p.kind === 0), paths: row.paths.length })), [receiver, epoch]);
    const put = await seen(2, 0);
    // The recording's first epoch is nanoseconds before the truth: the view begins with the second.
    const tow = [...new Set(rows.map((r) => r.gps_tow))][13];
    assert.deepEqual(put.map((one) => one.id), rows.filter((r) => r.gps_tow === tow).map((r) => r.sat));
    const simulated = await seen(1, 12);
    assert.ok(simulated.length > 5);
    for (const { id, direct } of simulated) assert.equal(put.find((one) => one.id === id).direct, direct, id);
    assert.ok(put.some((one) => one.paths > 1));
    await page.page.keyboard.press('Escape');
    assert.equal(await page.run('canyon.state.receiver'), 0);
    assert.deepEqual(page.complaints, []);
  } finally {
    await page.close();
    assert.equal(await judged.stop(), 0);
  }
});

test('a finished run is shown from its folder, and a bare one says what to do', { skip }, async () => {
  const bare = await Running.refused(['view', folder]);
  assert.match(bare, /is a folder without a view; write one with 'canyon simulate SCENARIO --out DIR --view'/);
  await writeFile(join(folder, 'city.txt'), 'no city');
  assert.notEqual(await Running.refused(['view', join(folder, 'city.txt')]), '');
});
