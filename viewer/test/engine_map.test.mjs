// A heat map that the engine computed, on the page: its cells say what `canyon heatmap query` says. CANYON names the program
// (default: ../build-release/bin/canyon); without it this test is skipped, and says so.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { existsSync } from 'node:fs';
import { mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { test } from 'node:test';
import { kPatience, Session, withoutChromium } from './browser.mjs';

const root = fileURLToPath(new URL('../..', import.meta.url));
const program = process.env.CANYON ?? join(root, 'build-release/bin/canyon');
const skip = withoutChromium || (existsSync(program) ? false : `SKIPPED: no ${program} (./run build)`);

test('cells say what the map says', { skip }, async () => {
  const folder = await mkdtemp(join(tmpdir(), 'canyon-map-'));
  const env = { ...process.env, CANYON_VIEWER: join(root, 'viewer/dist/viewer.html') };
  const canyon = (...words) => execFileSync(program, words, { env, timeout: kPatience, encoding: 'utf8' });
  const scenario = join(root, 'examples/synthetic_drive.yaml');
  let s;
  try {
    canyon('heatmap', scenario, '--model', 'specular', '--layers', 'horizontal_error,hdop,satellites_visible,sky_view', '--altitude', '2,30',
      '--enu-box', '-100,-100,100,100', '--spacing', '5', '--format', 'netcdf', '--out', folder, '--quiet');
    const map = join(folder, 'map.nc');
    canyon('view', map, '--city', scenario, '--export', join(folder, 'map.html'), '--quiet');
    s = await Session.open(join(folder, 'map.html'));
    const origin = (await s.run('canyon.store.header.frame.origin'));
    const layers = await s.run('canyon.store.header.map.layers.map((l) => [l.name, l.factor, l.decimals])');
    let compared = 0;
    for (const altitude of [0, 1]) {
      await s.run((a) => window.canyon.heat.select({ altitude: a }), altitude);
      await s.page.waitForFunction((a) => window.canyon.heat.builtAltitude === a, altitude);
      for (const [column, row] of [[0, 0], [20, 20], [39, 39], [7, 31], [25, 12], [20, 2], [3, 20], [20, 36]]) {
        const [east, north, up] = await s.run(([c, r]) => window.canyon.heat.centre(c, r), [column, row]);
        assert.ok(Math.abs(up - [2, 30][altitude]) < 0.011);  // the city has no hills
        // Near the origin, on the sphere of its curvature: within a centimetre at 100 m, cells are 5 m wide.
        const latitude = origin.latitude_deg + (north / 6_340_000) * (180 / Math.PI);
        const longitude = origin.longitude_deg + (east / (6_381_000 * Math.cos((latitude * Math.PI) / 180))) * (180 / Math.PI);
        const told = JSON.parse(canyon('heatmap', 'query', map, '--at', `${latitude},${longitude}`, '--altitude', String([2, 30][altitude]), '--json'));
        const shown = await s.run(([c, r]) => window.canyon.store.header.map.layers.map((_, k) => window.canyon.heat.text(c, r, k)), [column, row]);
        layers.forEach(([name, factor, decimals], k) => {
          const value = told.values[name];
          const where = `${name} at ${column}, ${row}: ${shown[k]}, ${value}`;
          if (told.state !== 'computed') assert.equal(shown[k], told.state, where);
          else if (value === null) assert.match(shown[k], /^no value/, where);
          else assert.ok(Math.abs(parseFloat(shown[k]) - value * factor) <= 0.51 * 10 ** -(Math.abs(value * factor) >= 99.95 ? 1 : decimals), where);
          compared += value === null ? 0 : 1;
        });
      }
    }
    assert.ok(compared > 15, `${compared} values`);
    assert.deepEqual(s.complaints, []);
  } finally {
    await s?.close();
    await rm(folder, { recursive: true, force: true });
  }
});
