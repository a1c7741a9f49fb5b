// `canyon view WHAT --live ADDRESS` with a `canyon live`: epochs as they arrive, and the behaviour when either ends.
import Ajv from 'ajv';
import assert from 'node:assert/strict';
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { createSocket } from 'node:dgram';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Session, withoutChromium } from './browser.mjs';
import { csv, program, root, Running, withoutProgram } from './program.mjs';

const skip = withoutChromium || withoutProgram;
const scenario = join(root, 'examples/synthetic_drive.yaml');
let folder;
let stream;
let port;
let viewer;
let host;
let s;

const freePort = () => new Promise((resolve) => {
  const server = createServer().listen(0, '127.0.0.1', () => {
    const { port: free } = server.address();
    server.close(() => resolve(free));
  });
});
/** The scenario's drive in real time, this number of seconds. */
const drive = (seconds, file) => Running.start(['live', scenario, '--duration', String(seconds), '--quiet', '--stream',
  `view=${stream}`, '--stream', `epochs_csv=file:${join(folder, file)}`], { serves: false });
const view = () => Running.start(['view', scenario, '--live', stream, '--port', String(port), '--quiet']);
/** Errors of broken lines are expected here. */
const complaints = () => s.complaints.filter((text) => !/WebSocket connection to .* failed|ERR_CONNECTION_REFUSED/.test(text));

before(async () => {
  if (skip) return;
  folder = await mkdtemp(join(tmpdir(), 'canyon-live-'));
  stream = `tcp://127.0.0.1:${await freePort()}`;
  port = await freePort();
  viewer = await view();
  s = await Session.open(viewer.address);
});
after(async () => {
  await s?.close();
  await host?.stop();
  await viewer?.stop();
  if (folder) await rm(folder, { recursive: true, force: true });
});

test('shows the city and waits for a host', { skip }, async () => {
  assert.equal(await s.text('#follow-live'), 'Live: waiting for an epoch');
  assert.ok(await s.run('canyon.store.header.city.objects.length') > 50);
  assert.deepEqual(complaints(), []);
});

test('follows the newest epoch; its numbers are those of the CSV file', { skip }, async () => {
  host = await drive(10, 'epochs.csv');
  await s.page.waitForFunction(() => window.canyon?.store.tracks[0]?.size >= 4);
  assert.equal(await s.text('#follow-live'), 'Live');
  assert.ok(await s.page.locator('tr[data-satellite]').count() > 5);
  assert.ok(await s.run(() => canyon.store.tracks[0].skyline(canyon.state.epoch).length === 120));
  await s.page.waitForFunction(() => canyon.state.time === canyon.store.tracks[0].time.at(-1));  // with the next picture
  assert.equal(await host.ended, 0);
  const rows = await csv(join(folder, 'epochs.csv'));
  await s.page.waitForFunction((n) => canyon.store.tracks[0].time.at(-1) >= n, Number(rows.at(-1).gps_tow) - Number(rows[0].gps_tow) - 1e-6);
  const names = ['error_east_m', 'error_north_m', 'error_up_m', 'hdop', 'pdop', 'used', 'tracked', 'not_tracked'];
  const shown = await s.run((list) => ({ time: Array.from(canyon.store.tracks[0].time),
    columns: list.map((n) => Array.from(canyon.store.tracks[0].epochs.column(n), String)) }), names);
  assert.ok(shown.time.length >= 4);
  // Epochs from before the page was loaded are not on it; all others are, one row each.
  const skipped = rows.length - shown.time.length;
  shown.time.forEach((time, i) => {
    const row = rows[skipped + i];
    assert.ok(Math.abs(time - (Number(row.gps_tow) - Number(rows[0].gps_tow))) < 1e-6);
    names.forEach((n, k) => {
      if (row[n] === '') return assert.equal(shown.columns[k][i], 'NaN', `${n} at epoch ${i}`);
      const digits = row[n].split('.')[1]?.length ?? 0;
      assert.ok(Math.abs(Number(shown.columns[k][i]) - Number(row[n])) <= 0.5000001 * 10 ** -digits, `${n} at epoch ${i}`);
    });
  });
  // Its last epoch, as displayed.
  await s.page.waitForFunction(() => canyon.state.time === canyon.store.tracks[0].time.at(-1));
  assert.equal((await s.text('#readout [data-name="error_east_m"]')).split(' ')[0], Number(rows.at(-1).error_east_m).toFixed(2));
});

test('says that the host is silent, and begins anew with its next run', { skip }, async () => {
  await s.page.waitForFunction(() => /^Live: no epoch for/.test(document.getElementById('follow-live').textContent));
  await s.run(() => { window.samePage = true; });
  const last = await s.run('canyon.store.tracks[0].time.at(-1)');
  host = await drive(280, 'more.csv');
  await s.page.waitForFunction((t) => canyon.store.tracks[0].time.at(-1) < t && canyon.store.tracks[0].size > 1, last);
  assert.ok(await s.run('window.samePage'), 'the same run of the same host needs no other page');
  assert.equal(await s.text('#follow-live'), 'Live');
});

test('reconnects by itself when its server comes back, and says so meanwhile', { skip }, async () => {
  await viewer.stop('SIGKILL');
  await s.page.waitForFunction(() => document.getElementById('follow-live').textContent === 'Connection lost; trying again');
  const size = await s.run('canyon.store.tracks[0].size');
  viewer = await view();
  await s.page.waitForFunction((n) => canyon.store.tracks[0].size > n, size);
  await s.page.waitForFunction(() => document.getElementById('follow-live').textContent === 'Live');
  assert.ok(await s.run('window.samePage'));
  assert.deepEqual(complaints(), []);
});

test('an earlier epoch stays until one goes back to now', { skip }, async () => {
  await s.page.keyboard.press('Home');
  const time = await s.run('canyon.state.time');
  await s.page.waitForFunction((n) => canyon.store.tracks[0].size > n, await s.run('canyon.store.tracks[0].size'));
  assert.equal(await s.run('canyon.state.time'), time);
  assert.equal(await s.text('#follow-live'), 'Live: go to now');
  await s.page.click('#follow-live');
  await s.page.waitForFunction((t) => canyon.state.time > t, time);
});

test('an antenna is put into the host\'s sky, and goes with its time', { skip }, async () => {
  await s.run(() => {
    const t = canyon.store.tracks[0];
    document.getElementById('probe-height').value = '0';
    canyon.probe.put([t.east.at(-1), t.north.at(-1), t.up.at(-1)]);
  });
  await s.page.waitForFunction(() => canyon.state.receiver === 1);
  const [own, put] = await s.run(() => [0, 1].map((r) => {
    const time = canyon.store.tracks[1].time[0];
    const epoch = r === 1 ? 0 : canyon.store.tracks[0].epochAt(time);
    return { time: canyon.store.tracks[r].time[epoch], rows: canyon.store.satellites(r, epoch).map((row) =>
      [canyon.store.header.satellites[row.satellite].id, row.azimuth_deg, row.elevation_deg]) };
  }));
  assert.equal(put.time, own.time);
  assert.deepEqual(put.rows.map((row) => row[0]), own.rows.map((row) => row[0]));
  // An epoch may have arrived between position and time: 4 m in 20,000 km.
  put.rows.forEach(([id, azimuth, elevation], i) => {
    assert.ok(Math.abs(((azimuth - own.rows[i][1] + 540) % 360) - 180) < 1e-3 && Math.abs(elevation - own.rows[i][2]) < 1e-4, id);
  });
  await s.page.waitForFunction((t) => canyon.store.tracks[1].time[0] > t, put.time);
  await s.page.keyboard.press('Escape');
  assert.equal(await s.run('canyon.state.receiver'), 0);
});

test('messages are what the schema says; of a long run the newest are kept', { skip }, async () => {
  const schema = JSON.parse(await readFile(join(root, 'viewer/schema.json'), 'utf8'));
  const ajv = new Ajv({ allowUnionTypes: true });
  const valid = ajv.compile({ ...schema.definitions.message, definitions: schema.definitions });
  const got = await s.run(async () => {
    const socket = new WebSocket(`ws://${location.host}/messages`);
    const texts = [];
    await new Promise((resolve) => (socket.onmessage = (e) => texts.push(e.data) === 3 && resolve()));
    socket.close();
    return texts.map((t) => JSON.parse(t));
  });
  assert.deepEqual(got.map((m) => m.type), ['hello', 'epoch', 'epoch']);
  for (const message of got) assert.ok(valid(message), JSON.stringify(valid.errors));
  const header = await s.run(async () => (await fetch('view/view.json')).json());
  assert.ok(ajv.compile(schema)(header), JSON.stringify(ajv.errors));
  assert.equal(header.live, true);
  await host.stop();
  const kept = await s.run((message) => {
    const { canyon } = window;
    for (let i = 0; i < 3000; ++i) canyon.live.take({ ...message, time_s: 1000 + i / 10 });
    const t = canyon.store.tracks[0];
    const last = canyon.store.satellites(0, t.size - 1);
    const blocks = canyon.store.loadedBlocks(0).map((b) => b.entry.first_epoch);
    return { size: t.size, inOrder: blocks.every((first, i) => first === i), blocks: blocks.length, satellites: last.length };
  }, got[2]);
  assert.deepEqual(kept, { size: 1200, inOrder: true, blocks: 1200, satellites: got[2].satellites.length });
});

test('receivers of several streams are on one page', { skip }, async () => {
  const two = join(folder, 'two.yaml');
  await writeFile(two, (await readFile(scenario, 'utf8')).replace('receivers:\n', 'receivers:\n  - {name: phone, profile: phone}\n'));
  const streams = [`tcp://127.0.0.1:${await freePort()}`, `tcp://127.0.0.1:${await freePort()}`];
  const other = await Running.start(['view', two, '--live', streams[0], '--live', streams[1], '--quiet']);
  const both = await Running.start(['live', two, '--duration', '280', '--quiet', '--stream', `phone/view=${streams[0]}`,
    '--stream', `car/view=${streams[1]}`], { serves: false });
  let page;
  try {
    page = await Session.open(other.address);
    await page.page.waitForFunction(() => window.canyon?.store.tracks[0]?.size > 2 && canyon.store.tracks[1]?.size > 2);
    assert.deepEqual(await page.page.locator('#receiver option').allInnerTexts(), ['phone', 'car']);
    assert.ok(await page.page.locator('#receiver-choice').isVisible());
    assert.equal(await page.page.getByText('the other receivers', { exact: true }).count(), 1);
    // Same drive, same time: at common epochs they have the same position.
    const apart = await page.run(() => {
      const [a, b] = canyon.store.tracks;
      const at = Array.from(b.time).findIndex((t) => a.time.includes(t));
      const i = a.time.indexOf(b.time[at]);
      return at < 0 ? Infinity : Math.hypot(a.east[i] - b.east[at], a.north[i] - b.north[at]);
    });
    assert.ok(apart < 1e-6, `${apart} m`);
    await page.page.selectOption('#receiver', '1');
    assert.equal(await page.run('canyon.state.receiver'), 1);
    assert.deepEqual(page.complaints, []);
  } finally {
    await page?.close();
    await both.stop();
    await other.stop();
  }
});

test('a host without poses is waited for; where they stop, the antenna stays where it was', { skip }, async () => {
  const address = `tcp://127.0.0.1:${await freePort()}`;
  const [listener, sender] = [createSocket('udp4'), createSocket('udp4')];
  await new Promise((resolve) => listener.bind(0, '127.0.0.1', resolve));
  const { port: poses } = listener.address();
  await new Promise((resolve) => listener.close(resolve));
  const other = await Running.start(['view', scenario, '--live', address, '--quiet']);
  const flight = await Running.start(['live', scenario, '--quiet', '--poses', `udp-listen://127.0.0.1:${poses}`, '--stream', `view=${address}`], { serves: false });
  let page;
  let beat;
  try {
    page = await Session.open(other.address);
    await page.page.waitForFunction(() => document.getElementById('follow-live').textContent === 'Live: the host has no pose yet');
    const begin = Date.now();
    beat = setInterval(() => sender.send(`{"time_s": ${(Date.now() - begin) / 1000}, "position_m": [38, -76, 1.5]}\n`, poses, '127.0.0.1'), 50);
    await page.page.waitForFunction(() => canyon.store.tracks[0]?.size > 2);
    clearInterval(beat);
    await page.page.waitForFunction(() => /position is unknown/.test(document.getElementById('readout').innerText));
    const place = await page.run(() => canyon.scene.control.target.toArray());
    [38, -76, 1.5].forEach((metres, axis) => assert.ok(Math.abs(place[axis] - metres) < 1e-3, String(place)));
    assert.deepEqual(page.complaints, []);
  } finally {
    clearInterval(beat);
    sender.close();
    await page?.close();
    await flight.stop();
    await other.stop();
  }
});
