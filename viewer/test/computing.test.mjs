// `canyon view SCENARIO` while its run is computed: epochs as they arrive, then the complete run.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtemp, readdir, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Session, withoutChromium } from './browser.mjs';
import { csv, program, root, Running, withoutProgram } from './program.mjs';

const skip = withoutChromium || withoutProgram;
/** The time limit of a whole run on a busy machine [ms]. */
const kRun = { timeout: 200_000 };
let folder;
let scenario;
let server;
let s;

/** On one thread, so that it takes longer than opening a page, also on a large machine. */
const view = () => Running.start(['view', scenario, '--threads', '1', '--quiet'], { environment: { TMPDIR: folder } });
/** Folders of views in computation. */
const views = async () => (await readdir(folder)).filter((name) => name.startsWith('canyon-view-'));
const computing = (session) => session.page.waitForFunction(() => /^Computing: \d+ of 3041 epochs/.test(document.getElementById('follow-live').textContent)
  && window.canyon?.store.tracks[0]?.size > 3 && canyon.store.tracks[1]?.size > 3);

before(async () => {
  if (skip) return;
  folder = await mkdtemp(join(tmpdir(), 'canyon-computing-'));
  scenario = join(folder, 'drive.yaml');
  const example = await readFile(join(root, 'examples/synthetic_drive.yaml'), 'utf8');
  await writeFile(scenario, example.replace('rate_hz: 2', 'rate_hz: 10').replace('receivers:\n', 'receivers:\n  - {name: phone, profile: phone}\n'));
});
after(async () => {
  await s?.close();
  await server?.stop();
  if (folder) await rm(folder, { recursive: true, force: true });
});

test('the page opens while the run is computed, and follows it', { skip }, async () => {
  server = await view();
  s = await Session.open(server.address);
  await computing(s);
  assert.equal(await s.run('canyon.store.header.live'), true);
  const time = await s.run('canyon.state.time');
  await s.page.waitForFunction((t) => canyon.state.time > t, time);
  assert.ok(await s.page.locator('tr[data-satellite]').count() > 5);
  assert.deepEqual(await s.page.locator('#receiver option').allInnerTexts(), ['phone', 'car']);
  assert.deepEqual(s.complaints, []);
});

test('who looks at an earlier epoch stays there, and may put antennas meanwhile', { skip }, async () => {
  await s.page.selectOption('#receiver', '1');
  await s.page.keyboard.press('Home');
  await s.page.keyboard.press('1');
  await s.run(() => {
    Object.assign(canyon.scene.control, { azimuth: 123, down: 45, distance: 321 });
    canyon.state.selectSatellite(canyon.store.satellites(1, 0)[2].satellite);
  });
  assert.match(await s.text('#follow-live'), /; go to the newest$/);
  await s.run(() => canyon.probe.put([0, 0, 0]));
  await s.page.waitForFunction(() => canyon.state.receiver === 2);
  await s.page.keyboard.press('Escape');
  await s.run(() => canyon.state.selectSatellite(canyon.store.satellites(1, 0)[2].satellite));
});

test('when it has ended the page shows all of it, as it stands', { skip, timeout: 240_000 }, async () => {
  const before = await s.run(() => ({ satellite: canyon.state.satellite, time: canyon.state.time, id: canyon.store.header.satellites[canyon.state.satellite].id }));
  await s.page.waitForFunction(() => !canyon.store.header.live, null, kRun);
  await s.page.waitForFunction(() => canyon.store.loaded(1, canyon.state.epoch));
  const after = await s.run(() => ({ satellite: canyon.state.satellite, time: canyon.state.time, id: canyon.store.header.satellites[canyon.state.satellite].id }));
  assert.deepEqual(after, before);
  assert.deepEqual(await s.run(() => [canyon.state.receiver, canyon.state.camera, canyon.scene.control.azimuth, canyon.scene.control.distance]), [1, 'free', 123, 321]);
  assert.ok(await s.page.locator('#follow-live').isHidden());
  assert.ok(await s.page.locator('tr.chosen[data-satellite]').count());
  // Nothing is lost: rows, charts, summary and blocks are those of the run's CSV files.
  const out = join(folder, 'out');
  execFileSync(program, ['simulate', scenario, '--out', out, '--quiet'], { stdio: 'inherit' });
  const names = ['error_east_m', 'error_north_m', 'error_up_m', 'hdop', 'pdop', 'used', 'tracked', 'not_tracked'];
  for (const [receiver, name] of ['phone', 'car'].entries()) {
    const rows = await csv(join(out, name, 'epochs.csv'));
    const shown = await s.run(([r, list]) => list.map((n) => Array.from(canyon.store.tracks[r].epochs.column(n), String)), [receiver, names]);
    assert.equal(rows.length, 3041);
    names.forEach((n, k) => {
      assert.equal(shown[k].length, rows.length);
      rows.forEach((row, i) => {
        if (row[n] === '') return assert.equal(shown[k][i], 'NaN', `${n} at epoch ${i}`);
        const digits = row[n].split('.')[1]?.length ?? 0;
        assert.ok(Math.abs(Number(shown[k][i]) - Number(row[n])) <= 0.5000001 * 10 ** -digits, `${n} at epoch ${i}`);
      });
    });
    if (name === 'car') {
      await s.page.click('[data-tab="summary"]');
      assert.equal(await s.text('[data-name="epochs"]'), '3041');
      assert.match(await s.text('[data-name="fixes"]'), new RegExp(`^${rows.filter((row) => row.status === 'fix').length}\\b`));
    }
  }
  assert.equal(await s.run('canyon.chart.plot.data[0].length'), 3041);
  await s.page.keyboard.press('End');
  await s.page.waitForFunction(() => canyon.store.loaded(1, 3040));
  assert.equal(await s.run('canyon.state.epoch'), 3040);
  assert.deepEqual(s.complaints, []);
});

test('a page that comes later finds the run as any other', { skip }, async () => {
  const late = await Session.open(server.address);
  try {
    assert.equal(await late.run('canyon.store.tracks[1].size'), 3041);
    assert.ok(await late.page.locator('#follow-live').isHidden());
    assert.deepEqual(late.complaints, []);
  } finally {
    await late.close();
  }
  assert.equal(await server.stop(), 0);
  assert.deepEqual(await views(), []);
});

test('Ctrl-C while it is computed ends it and leaves nothing', { skip }, async () => {
  const other = await view();
  assert.equal((await views()).length, 1);
  assert.equal(await other.stop(), 130);
  assert.deepEqual(await views(), []);
});

test('a run that fails says so, here and there', { skip }, async () => {
  const other = await view();
  const page = await Session.open(other.address);
  try {
    await computing(page);
    // No further file of the view can be written. One may be written while the folder is emptied: then try again.
    for (const name of await views()) await rm(join(folder, name), { recursive: true, maxRetries: 20 });
    await page.page.waitForFunction(() => document.getElementById('follow-live').textContent === 'The run failed');
    assert.match(await page.text('#toast'), /canyon-view-.*block-/);
    assert.equal(await other.ended, 2);
  } finally {
    await page.close();
    await other.stop();
  }
});
