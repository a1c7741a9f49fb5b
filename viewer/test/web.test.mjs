// Canyon in one page (./run web): the module in Node compared with the native program, and the page in a headless Chromium.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { existsSync } from 'node:fs';
import { mkdtemp, readFile, rm, stat, writeFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { Session, withoutChromium } from './browser.mjs';
import { csv, program, root, withoutProgram } from './program.mjs';

const glue = join(root, 'build-web/canyon.js');
const page = join(root, 'viewer/dist/web.html');
const withoutModule = existsSync(glue) && existsSync(page) ? false : 'SKIPPED: no build-web/canyon.js (./run web)';
if (withoutModule) console.error(withoutModule);

const kDemo = join(root, 'examples/synthetic_drive.yaml');
/** A hall of 20 m on the path of a 200 m drive, as OBJ, and its drive as GPX. */
const kObj = ['v 10 -30 0', 'v 50 -30 0', 'v 50 -10 0', 'v 10 -10 0', 'v 10 -30 20', 'v 50 -30 20', 'v 50 -10 20', 'v 10 -10 20',
  'f 5 6 7 8', 'f 1 2 6 5', 'f 2 3 7 6', 'f 3 4 8 7', 'f 4 1 5 8', ''].join('\n');
const kGpx = `<?xml version="1.0"?><gpx version="1.1"><trk><trkseg>${Array.from({ length: 41 }, (_, i) =>
  `<trkpt lat="22.3" lon="${(114.17 + i * 5 / 103000).toFixed(7)}"><ele>1.5</ele><time>2026-06-01T08:00:${String(i).padStart(2, '0')}Z</time></trkpt>`).join('')}</trkseg></trk></gpx>`;

describe('the module in Node', { skip: withoutModule || withoutProgram }, () => {
  let module;
  let folder;
  let native;
  const ask = (question) => JSON.parse(module.ccall('canyon_do', 'string', ['string'], [JSON.stringify(question)]));
  before(async () => {
    folder = await mkdtemp(join(tmpdir(), 'canyon-web-'));
    native = join(folder, 'native');
    execFileSync(program, ['simulate', kDemo, '--out', native, '--quiet']);
    const wasmBinary = await readFile(join(root, 'build-web/canyon.wasm'));
    module = await createRequire(import.meta.url)(glue)({ wasmBinary, progress: () => {} });
    module.FS.writeFile('viewer.html', await readFile(join(root, 'viewer/dist/viewer.html')));
  });
  after(() => rm(folder, { recursive: true, force: true }));

  test("the demo's drive is the native program's within 1 mm", async () => {
    module.FS.writeFile('scenario.yaml', await readFile(kDemo));
    const made = ask({ do: 'run' });
    assert.equal(made.error, undefined);
    assert.ok(made.files.includes('out/epochs.csv') && made.files.includes('out/receiver.nmea'), String(made.files));
    const table = join(folder, 'epochs.csv');
    await writeFile(table, module.FS.readFile('out/epochs.csv'));
    const [here, there] = [await csv(table), await csv(join(native, 'epochs.csv'))];
    assert.equal(here.length, there.length);
    const columns = Object.keys(there[0]).filter((name) => /^error_.*_m$/.test(name));
    assert.equal(columns.length, 3);
    let most = 0;
    here.forEach((row, i) => columns.forEach((name) => {
      assert.equal(row[name] === '', there[i][name] === '', `epoch ${i}`);
      most = Math.max(most, Math.abs(Number(row[name]) - Number(there[i][name])));
    }));
    console.log(`# ${here.length} epochs in ${made.seconds.toFixed(2)} s; fixes differ by ${(most * 1000).toFixed(3)} mm at most`);
    assert.ok(most <= 1e-3, `${most} m`);
  });
  test('a mesh, a navigation file and a track become a scenario, which runs', async () => {
    module.FS.writeFile('hall.obj', kObj);
    module.FS.writeFile('drive.gpx', kGpx);
    module.FS.writeFile('sky.nav', await readFile(join(native, 'sky.nav')));
    const made = ask({ do: 'new', files: ['hall.obj', 'sky.nav', 'drive.gpx'], origin: '22.3,114.17,0' });
    assert.equal(made.error, undefined);
    assert.match(made.yaml, /hall\.obj/);
    module.FS.writeFile('scenario.yaml', made.yaml);
    assert.equal(ask({ do: 'run', seconds: 20 }).error, undefined);
  });
  test('a heat map is laid over the view', async () => {
    assert.equal(ask({ do: 'map', box: [-60, -60, 60, 60], spacing_m: 10 }).error, undefined);
    assert.match(new TextDecoder().decode(module.FS.readFile('out/page.html')), /data-canyon-file="map-0-0\.bin\.gz"/);
    assert.match(ask({ do: 'map', box: [90000, 0, 90100, 100], spacing_m: 10 }).error, /outside the city/);
  });
  test('what is wrong is said with its line, and the next run works', async () => {
    module.FS.writeFile('scenario.yaml', (await readFile(kDemo, 'utf8')).replace('rate_hz: 2', 'rate_hz: fast'));
    assert.match(ask({ do: 'run' }).error, /^scenario\.yaml:16: .*rate_hz/);
    module.FS.writeFile('city.canyon', Buffer.from('CANYON\0broken bytes'));
    assert.match(ask({ do: 'new', files: ['city.canyon'] }).error, /city\.canyon/);
    module.FS.writeFile('map.osm', '<osm version="0.6"></osm>');
    assert.match(ask({ do: 'new', files: ['map.osm'] }).error, /cannot be read in a page; build a city/);
    module.FS.writeFile('scenario.yaml', await readFile(kDemo));
    assert.equal(ask({ do: 'run', seconds: 1 }).error, undefined);
  });
});

describe('the page', { skip: withoutModule || withoutChromium }, () => {
  let s;
  const shown = (times) => s.page.waitForFunction((n) => Number(document.body.dataset.shown ?? 0) >= n, times, { timeout: 120_000 });
  const viewer = async () => {
    const frame = s.page.frames().find((f) => f.url().startsWith('blob:'));
    await frame.waitForSelector('body[data-loaded=true]', { state: 'attached' });
    return frame;
  };
  before(async () => {
    s = await Session.open(page);
  });
  after(() => s?.close());

  test('at most 10 MB; the demo is there at once, and nothing is asked of a network', async () => {
    assert.ok((await stat(page)).size <= 10e6);
    const begin = Date.now();
    await shown(1);
    await viewer();
    const first = s.loadedMs + Date.now() - begin;
    const { processInfo } = await (await s.browser.newBrowserCDPSession()).send('SystemInfo.getProcessInfo');
    const cpu = processInfo.reduce((sum, { cpuTime }) => sum + cpuTime, 0);
    await shown(2);
    const frame = await viewer();
    console.log(`# first picture after ${(first / 1000).toFixed(1)} s (CPU of all of Chromium ${cpu.toFixed(1)} s), the drive computed in ${await s.page.evaluate(() => document.body.dataset.seconds)} s`);
    assert.equal(await frame.evaluate(() => window.canyon.store.tracks[0].size), 609);
    assert.deepEqual(s.complaints, []);
    assert.deepEqual(s.requests.filter((url) => !/^(file|blob|data):/.test(url)), []);
  });
  test('an antenna that is put is traced in the page', async () => {
    const frame = await viewer();
    await frame.evaluate(() => window.canyon.probe.put([0, 20, 0]));
    await frame.waitForFunction(() => Number.isFinite(window.canyon.probe.answerMs));
    assert.ok(await frame.evaluate(() => window.canyon.state.receiver === window.canyon.probe.receiver));
  });
  test('clicks become a drive', async () => {
    await s.page.click('#draw');
    const frame = await viewer();
    for (const place of [[-228, -228, 0], [-228, -150, 0]]) {
      await frame.evaluate((where) => window.canyon.probe.put(where), place);
      await s.page.waitForTimeout(300);
    }
    await s.page.waitForFunction(() => document.getElementById('draw').textContent === 'Drive through 2 corners');
    await s.page.click('#draw');
    await shown(3);
    assert.match(await s.page.locator('#scenario').inputValue(), /- \{east_m: -228\.0, north_m: -150\.0\}\n  speed_mps: 8/);
    assert.ok(await (await viewer()).evaluate(() => Math.abs(window.canyon.store.tracks[0].length - 78) < 4));
  });
  test('a heat map of what is in view', async () => {
    await s.page.click('#map');
    await shown(4);
    assert.ok(await (await viewer()).evaluate(() => window.canyon.store.header.map.layers.length > 0));
  });
  test('files are taken away, and dropped ones taken in', async () => {
    await s.page.evaluate(() => (document.getElementById('saves').open = true));
    const [download] = await Promise.all([s.page.waitForEvent('download'), s.page.getByRole('button', { name: 'epochs.csv', exact: true }).click()]);
    assert.match(await readFile(await download.path(), 'utf8'), /^gps_week,/);
    await s.page.locator('#origin').evaluate((box) => (box.value = '22.3,114.17,0'));
    await s.page.setInputFiles('#files', [{ name: 'hall.obj', mimeType: 'text/plain', buffer: Buffer.from(kObj) },
      { name: 'drive.gpx', mimeType: 'text/plain', buffer: Buffer.from(kGpx) }]);
    await shown(5);
    assert.equal(await (await viewer()).evaluate(() => window.canyon.store.tracks[0].size), 41);
  });
  test('what is wrong is said, and the page goes on', async () => {
    await s.page.evaluate(() => (document.getElementById('scenario').value += 'colour: red\n'));
    await s.page.evaluate(() => document.getElementById('run').click());
    await s.page.waitForSelector('#status.bad');
    assert.match(await s.text('#status'), /scenario\.yaml:\d+: .*colour/);
    await s.page.click('#demo');
    await shown(7);
    assert.deepEqual(s.complaints, []);
  });

  /** The page's status after it has shown this number of further views. */
  const once = async (views, action) => {
    const before = await s.page.evaluate(() => Number(document.body.dataset.shown));
    await action();
    await shown(before + views);
    await s.page.waitForFunction(() => !document.getElementById('run').disabled);
    return s.text('#status');
  };
  const drop = (...files) => s.page.setInputFiles('#files', files.map(([name, text]) => ({ name, mimeType: 'text/plain', buffer: Buffer.from(text) })));
  const refused = async (name, ...files) => {
    await drop(...files);
    await s.page.waitForFunction((text) => document.querySelector('#status.bad')?.textContent.includes(text), name);
    await s.page.waitForFunction(() => !document.getElementById('run').disabled);
  };
  test('a file that is refused blocks none after it, and a new one replaces that before', async () => {
    const yaml = () => s.page.locator('#scenario').inputValue();
    await refused('pic.png', ['pic.png', '\x89PNG\r\n\x1a\n\0\0']);
    await refused('no file is a city', ['drive.gpx', kGpx]);
    assert.match(await once(1, () => drop(['hall.obj', kObj])), /^Computed/);
    assert.match(await yaml(), /hall\.obj[^]*drive\.gpx/);
    assert.match(await once(1, () => drop(['second.obj', kObj.replaceAll(' 20', ' 30')])), /^Computed/);
    assert.match(await yaml(), /second\.obj[^]*drive\.gpx/);
    const before = await yaml();
    await refused('scenario.yaml', ['scenario.yaml', 'seed: 1\n']);
    await refused('broken.canyon', ['broken.canyon', 'CANYON\0broken bytes']);
    await refused('broken.gpx', ['broken.gpx', '<?xml version="1.0"?><gpx version="1.1"><trk>']);
    assert.equal(await yaml(), before);
    assert.match(await once(1, () => drop(['shorter.gpx', kGpx.replace(/(<trkpt((?!<trkpt).)*){20}/, '')], ['pic.png', 'P'])),
      /^Computed[^]*\npic\.png: /);
    assert.match(await yaml(), /second\.obj[^]*shorter\.gpx/);
    assert.doesNotMatch(await yaml(), /hall|drive\.gpx/);
    assert.equal(await (await viewer()).evaluate(() => window.canyon.store.tracks[0].size), 21);
    assert.deepEqual(s.complaints, []);
  });
  const corner = async (place) => {
    await (await viewer()).evaluate((where) => window.canyon.probe.put(where), place);
    await s.page.waitForTimeout(300);
  };
  const label = () => s.text('#draw');
  test('Escape, or the button before a second corner, ends the drawing', async () => {
    await s.page.click('#draw');
    assert.equal(await label(), 'Stop drawing');
    await s.page.click('#draw');
    assert.equal(await label(), 'Draw a route');
    for (const escape of [() => s.page.keyboard.press('Escape'), async () => (await viewer()).press('body', 'Escape')]) {
      await s.page.click('#draw');
      await corner([0, 20, 0]);
      await corner([0, 40, 0]);
      await s.page.waitForFunction(() => document.getElementById('draw').textContent === 'Drive through 2 corners');
      await escape();
      await s.page.waitForFunction(() => document.getElementById('draw').textContent === 'Draw a route');
      assert.ok(await (await viewer()).evaluate(() => !document.getElementById('stage').classList.contains('putting') && !window.canyon.probe.active));
    }
  });
  for (const [what, trajectory] of [['without a last newline', 'trajectory:\n  waypoints:\n    - {east_m: -76, north_m: 0}\n    - {east_m: 0, north_m: 0}\n  speed_mps: 3'],
    ['a list that is not indented', 'trajectory:\n  waypoints:\n  - {east_m: -76, north_m: 0}\n  - {east_m: 0, north_m: 0}\nrate_hz: 1 # kept\n'],
    ['a flow mapping in lines', 'trajectory: {waypoints: [{east_m: -76, north_m: 0}, # it\'s [\n{east_m: 0, north_m: 0}],\nspeed_mps: 3}\n# kept\nrate_hz: 1\n']])
    test(`a drive is drawn into a scenario: ${what}`, async () => {
      const text = `city:\n  synthetic: {blocks_east: 2, blocks_north: 2}\nsky: {nominal: true}\nstart: 2026-06-01T08:00:00Z\nduration_s: 3\nreceivers:\n- name: car\n${trajectory}`;
      await s.page.locator('#scenario').evaluate((box, value) => (box.value = value), text);
      await s.page.click('#draw');
      await corner([-76, -30, 0]);
      await corner([-76, 30, 0]);
      assert.match(await once(1, () => s.page.click('#draw')), /^Computed/);
      const yaml = await s.page.locator('#scenario').inputValue();
      assert.match(yaml, /\ntrajectory:\n  waypoints:\n    - \{east_m: -76\.0, north_m: -30\.0\}\n    - \{east_m: -76\.0, north_m: 30\.0\}\n  speed_mps: 8\n/);
      assert.equal(yaml.includes('kept'), text.includes('kept'));
    });
});
