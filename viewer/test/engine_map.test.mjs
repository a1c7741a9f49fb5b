// A heat map computed by the engine, on the page: its cells equal `canyon heatmap query`. CANYON names the program
// (default: ../build-release/bin/canyon); without it this test is skipped with a message.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { kPatience, Session, withoutChromium } from './browser.mjs';
import { program, Running, withoutProgram } from './program.mjs';

const skip = withoutChromium || withoutProgram;

test('cells say what the map says', { skip }, async () => {
  const folder = await mkdtemp(join(tmpdir(), 'canyon-map-'));
  const canyon = (...words) => execFileSync(program, words, { timeout: kPatience, encoding: 'utf8' });
  const cells = [[0, 0], [20, 20], [39, 39], [7, 31], [25, 12], [20, 2], [3, 20], [20, 36]];
  // A receiver without noise: a map's cell and an antenna put there have the same result.
  const scenario = join(folder, 'ideal.yaml');
  await writeFile(scenario, 'city: {synthetic: {seed: 3}}\nsky: {nominal: true, systems: [GPS, Galileo]}\nstart: 2026-06-01T12:00:00Z\n' +
    'duration_s: 1\ntrajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\nreceivers: [{name: rover, profile: ideal}]\n');
  let s, server;
  try {
    canyon('heatmap', scenario, '--layers', 'horizontal_error,hdop,satellites_visible,sky_view', '--altitude', '2,30',
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
      for (const [column, row] of cells) {
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
    await s.close();

    // Served with its scenario: an antenna at a cell has the map's count, at the map's altitude and time.
    server = await Running.start(['view', map, '--city', scenario, '--quiet']);
    s = await Session.open(server.address);
    assert.ok(await s.page.locator('#skyplot').isHidden());
    assert.doesNotMatch(await s.text('#tab-summary'), /epochs/);
    await s.run('canyon.heat.select({ altitude: 1 })');
    await s.page.waitForFunction(() => window.canyon.heat.builtAltitude === 1);
    const counts = await s.run((cells) => cells.map(([c, r]) => parseFloat(window.canyon.heat.text(c, r,
      window.canyon.store.header.map.layers.findIndex((l) => l.name === 'satellites_visible')))), cells);
    assert.ok(counts.filter(Number.isFinite).length >= 3, `${counts}`);
    for (const [i, [column, row]] of cells.entries()) {
      if (Number.isNaN(counts[i])) continue;  // within a building
      await s.run(([c, r]) => window.canyon.state.selectCell({ column: c, row: r }), [column, row]);
      await s.page.click('[data-put]');
      await s.page.waitForFunction(([c, r]) => {
        const { heat, store, probe } = window.canyon;
        const [track, at] = [store.tracks[probe.receiver], heat.centre(c, r)];
        return track && Math.hypot(track.east[0] - at[0], track.north[0] - at[1], track.up[0] - at[2]) < 0.02;
      }, [column, row]);
      const seen = await s.run(() => canyon.store.satellites(canyon.probe.receiver, 0).filter((x) => x.aboveMask &&
        canyon.store.header.words.visibility[x.visibility] !== 'blocked').length);
      assert.equal(seen, counts[i], `cell ${column}, ${row}`);
    }
    assert.ok(await s.page.locator('#skyplot').isVisible());
    assert.equal(await s.page.locator('#probe-height').inputValue(), '30');
    await s.page.keyboard.press('Escape');
    assert.ok(await s.page.locator('#skyplot').isHidden());
    assert.deepEqual(s.complaints, []);
  } finally {
    await s?.close();
    await server?.stop();
    await rm(folder, { recursive: true, force: true });
  }
});
