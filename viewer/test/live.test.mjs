// `canyon view WHAT --live ADDRESS` beside a `canyon live`: epochs as they come, and what happens when either goes away.
import Ajv from 'ajv';
import assert from 'node:assert/strict';
import { mkdtemp, readFile, rm } from 'node:fs/promises';
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
/** The scenario's drive in real time, so many seconds of it. */
const drive = (seconds, file) => Running.start(['live', scenario, '--duration', String(seconds), '--quiet', '--stream',
  `view=${stream}`, '--stream', `epochs_csv=file:${join(folder, file)}`], { serves: false });
const view = () => Running.start(['view', scenario, '--live', stream, '--port', String(port), '--quiet']);
/** A line that broke is what these tests break. */
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
  const names = ['error_east_m', 'error_north_m', 'error_up_m', 'hdop', 'pdop', 'used', 'visible', 'blocked'];
  const shown = await s.run((list) => ({ time: Array.from(canyon.store.tracks[0].time),
    columns: list.map((n) => Array.from(canyon.store.tracks[0].epochs.column(n), String)) }), names);
  assert.ok(shown.time.length >= 4);
  // Epochs from before the page was there are not on it; all others are, one row each.
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
  // Its last epoch, as people read it.
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
