// The page with a synthetic view with known numbers (sample.mjs).
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { after, before, test } from 'node:test';
import { Session, withoutChromium } from './browser.mjs';
import { fillPage, sampleView, withMap } from './sample.mjs';

const skip = withoutChromium;
const page = await readFile(new URL('../dist/viewer.html', import.meta.url), 'utf8');
let s;
before(async () => {
  if (!skip) s = await Session.open(fillPage(page, sampleView()));
});
after(() => s?.close());
const clean = () => {
  assert.deepEqual(s.complaints, []);
  assert.deepEqual(s.foreignRequests(), []);
};

test('opens from disk without a network or a complaint', { skip }, async () => {
  assert.equal(await s.text('[data-name="status"]'), 'fix');
  assert.match(await s.text('#title'), /^sample <\/script> drive/);
  clean();
});

test('something is drawn in three dimensions', { skip }, async () => {
  const drawn = await s.run(() => {
    const { scene } = window.canyon;
    scene.request();
    scene.frame();
    const gl = document.querySelector('#stage canvas').getContext('webgl2');
    const pixels = new Uint8Array(4 * 64 * 64);
    gl.readPixels(gl.drawingBufferWidth / 2 - 32, gl.drawingBufferHeight / 2 - 32, 64, 64, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return new Set(new Uint32Array(pixels.buffer)).size;
  });
  assert.ok(drawn > 50, `${drawn} colours`);
});

test('traffic stands where the file says', { skip }, async () => {
  /** The drawn triangles, and the box around those above or below the arrow's position. */
  const drawn = () => s.run(() => {
    const { scene, store } = window.canyon;
    const { array } = scene.bodies.mesh.geometry.getAttribute('position');
    const box = (from, to) => [0, 1, 2].map((k) => {
      const values = Array.from(array.slice(from, to)).filter((_, i) => i % 3 === k);
      return [Math.min(...values), Math.max(...values)].map((v) => Math.round(1000 * v) / 1000);
    });
    return { triangles: array.length / 9, bus: box(0, 12 * 9), tree: box(12 * 9, 92 * 9), rows: store.bodies(0, window.canyon.state.epoch).length };
  });
  await s.run('canyon.goTo(30)');
  // The bus is 12 m long northwards, 2.5 m wide, 8 m north of the antenna at -228 + 4 * 30 = -108.
  const even = await drawn();
  assert.deepEqual(even.bus, [[-109.25, -106.75], [2, 14], [0, 3]]);
  assert.equal(even.triangles, 12 + 6);  // and the arrow
  await s.run('canyon.goTo(31)');
  const odd = await drawn();
  assert.equal(odd.rows, 2);
  assert.equal(odd.triangles, 12 + 80 + 6);
  assert.deepEqual(odd.tree[2], [3, 7]);
  await s.page.keyboard.press('4');
  assert.equal((await drawn()).triangles, 12 + 80, 'no arrow where the camera stands');
  await s.page.keyboard.press('2');
  await s.run(() => {
    window.canyon.state.layers.bodies = false;
    window.canyon.state.changed('layers');
  });
  assert.equal((await drawn()).triangles, 0);
  await s.run(() => {
    window.canyon.state.layers.bodies = true;
    window.canyon.state.changed('layers');
  });
  clean();
});

test('pictures that follow one another are coarse without a graphics processor, and sharp when they rest', { skip }, async () => {
  const widths = await s.run(async () => {
    const { scene } = window.canyon;
    const canvas = document.querySelector('#stage canvas');
    const frames = async (n) => { for (let i = 0; i < n; ++i) await new Promise((done) => requestAnimationFrame(done)); };
    const seen = [];
    await frames(12);
    seen.push(canvas.width);
    for (let i = 0; i < 3; ++i) {
      scene.control.azimuth += 1;
      scene.request();
      await frames(1);
    }
    seen.push(canvas.width);
    await frames(12);
    seen.push(canvas.width);
    return seen;
  });
  assert.ok(Math.abs(widths[1] - widths[0] / 2) <= 1, `${widths}`);
  assert.equal(widths[2], widths[0]);
});

test('scrubbing goes to the epoch under the mouse', { skip }, async () => {
  const box = await s.page.locator('#timeline').boundingBox();
  // 119 s over the bar less 8 px on each side: 30 s.
  await s.page.mouse.click(box.x + 8 + ((box.width - 16) * 30.2) / 119, box.y + box.height / 2);
  assert.equal(await s.run('canyon.state.epoch'), 30);
  assert.equal(await s.raw('error_east_m'), 3);      // e / 10
  assert.equal(await s.raw('error_north_m'), 1.5);   // e / 20
  assert.ok(Math.abs((await s.raw('horizontal')) - Math.hypot(3, 1.5)) < 1e-12);
  assert.equal(await s.text('[data-name="clock"]'), '08:00:30.0');
  clean();
});

test('the correlation function of the selected satellite is that of its paths', { skip }, async () => {
  await s.page.click('[data-chart=correlation]');
  assert.equal(await s.text('#chart'), 'Select a satellite.');
  const labels = () => s.page.locator('#chart .u-legend .u-label').allInnerTexts();
  const at = (delay) => s.run((wanted) => {
    const [delays, magnitudes] = canyon.chart.plot.data;
    const i = delays.findIndex((d) => d >= wanted);
    return [delays[i], magnitudes[i]];
  }, delay);
  await s.run('canyon.goTo(3); canyon.state.selectSatellite(2)');  // G12, hidden: two reflections in opposition
  assert.deepEqual(await labels(), ['detour', 'G12 L1CA, all paths', '2 reflected', 'code loop at 10.0 m']);
  for (const wanted of [-280, 0, 12, 40, 250]) {
    const [delay, magnitude] = await at(wanted);
    const triangle = (excess) => Math.max(0, 1 - Math.abs(delay - excess) / 293);
    assert.ok(Math.abs(magnitude - Math.abs(10 ** -0.3 * triangle(12.5) - 10 ** -0.7 * triangle(30))) < 1e-6, `at ${delay} m`);
  }
  await s.run('canyon.state.selectSatellite(0)');
  assert.deepEqual(await labels(), ['detour', 'G01 L1CA, all paths', '1 direct', 'code loop at 0.0 m']);
  await s.run('canyon.state.selectSatellite(3)');
  assert.equal(await s.text('#chart'), 'Nothing arrives from G17.');
  await s.run('canyon.state.selectSatellite(8)');
  assert.match(await s.text('#chart'), /has no correlation functions/);
  await s.run('canyon.state.selectSatellite(null)');
  await s.page.click('[data-chart=error]');
  await s.page.click('#tabs [data-tab=satellites]');
  clean();
});

test('dragging along the chart goes through time', { skip }, async () => {
  const box = await s.page.locator('#chart .u-over').boundingBox();
  const at = (share) => [box.x + share * box.width, box.y + box.height / 2];
  await s.page.mouse.move(...at(0.25));
  await s.page.mouse.down();
  assert.equal(await s.run('canyon.state.epoch'), 29);  // of 119 s
  await s.page.mouse.move(...at(0.5), { steps: 5 });
  assert.equal(await s.run('canyon.state.epoch'), 59);
  await s.page.mouse.up();
  await s.page.mouse.move(...at(0.75));
  assert.equal(await s.run('canyon.state.epoch'), 59, 'the button is up');
  clean();
});

test('a click on what no map has tells what it is', { skip }, async () => {
  await s.run('canyon.goTo(31)');
  await s.page.keyboard.press('3');  // from above
  const box = await s.page.locator('#stage').boundingBox();
  const click = async (east, north) => {
    const [x, y] = await s.run(([e, n]) => {
      const { scene, store, state } = window.canyon;
      const at = scene.control.target.clone().set(store.tracks[0].east[state.epoch] + e, store.tracks[0].north[state.epoch] + n, 3);
      scene.control.apply(scene.host.clientWidth / scene.host.clientHeight);
      at.project(scene.control.camera);
      return [(at.x + 1) / 2, (1 - at.y) / 2];
    }, [east, north]);
    await s.page.mouse.click(box.x + x * box.width, box.y + y * box.height);
    return s.text('#toast');
  };
  assert.equal(await click(0, 7.3), 'Vehicle: 12.0 m long, 2.5 m wide, from 0.0 to 3.0 m (up)');
  assert.equal(await click(0, -7.3), 'Crown of a tree: 4.0 m across, from 3.0 to 7.0 m (up)');
  assert.match(await s.text('#tab-details'), /Click a satellite or a building/);
  await s.page.keyboard.press('2');
  clean();
});

test('to the next loss of fix, and to the largest error', { skip }, async () => {
  await s.page.keyboard.press('Home');
  await s.page.keyboard.press('l');
  assert.equal(await s.run('canyon.state.epoch'), 50);
  assert.equal(await s.text('[data-name="status"]'), 'no fix: too few satellites');
  assert.match(await s.text('#readout p'), /jammer/);
  await s.page.click('#largest');
  assert.equal(await s.run('canyon.state.epoch'), 119);
  await s.page.keyboard.press('l');  // round the end
  assert.equal(await s.run('canyon.state.epoch'), 50);
  clean();
});

test('a click in one panel selects in all', { skip }, async () => {
  await s.page.keyboard.press('Home');
  await s.page.click('#tabs [data-tab=satellites]');
  await s.page.click('tr[data-satellite="2"]');
  assert.equal(await s.run('canyon.state.satellite'), 2);
  assert.match(await s.text('#tab-details h3'), /^G12 GPS, NLOS, tracking/);
  assert.equal(await s.page.locator('.label.chosen').innerText(), 'G12');
  assert.deepEqual(await s.page.locator('table.paths tbody tr').allInnerTexts(),
    ['reflected\t12.50\t6.0', 'reflected, 2 times\t30.00\t14.0']);
  // Sky plot: E07 (index 7) is at azimuth 210, elevation 15 + 203 mod 70 = 78.
  const box = await s.page.locator('#skyplot canvas').boundingBox();
  const r = (Math.min(box.width, box.height) / 2 - 17) * (90 - 78) / 90;
  const a = (210 * Math.PI) / 180;
  await s.page.mouse.click(box.x + box.width / 2 + r * Math.sin(a), box.y + box.height / 2 - r * Math.cos(a));
  assert.equal(await s.run('canyon.state.satellite'), 7);
  await s.page.keyboard.press('Escape');
  assert.equal(await s.run('canyon.state.satellite'), null);
  clean();
});

test('the table is walked by the keyboard', { skip }, async () => {
  await s.page.keyboard.press('Home');
  await s.page.click('#tabs [data-tab=satellites]');
  await s.page.focus('tr[data-satellite="2"] button');
  await s.page.keyboard.press('ArrowRight');
  assert.equal(await s.run('canyon.state.epoch'), 1);
  assert.equal(await s.run('document.activeElement.closest("tr")?.dataset.satellite'), '2');
  await s.page.keyboard.press('Enter');
  assert.equal(await s.run('canyon.state.satellite'), 2);
  await s.page.keyboard.press('Escape');
  clean();
});

test('a click on a building tells its height and where that came from', { skip }, async () => {
  // From above, the camera over the middle of block 1 (-296..-236 east and north).
  await s.run(() => {
    const { canyon } = window;
    canyon.state.camera = 'top';
    canyon.state.changed('camera');
    canyon.scene.control.target.set(-266, -266, 0);
  });
  const box = await s.page.locator('#stage').boundingBox();
  await s.page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  assert.equal(await s.text('#tab-details h3'), 'block 1');
  assert.equal(await s.text('[data-name="height"]'), '12.0 m');
  assert.match(await s.text('#tab-details'), /storeys in the map/);
  clean();
});

test('every camera, both themes, both colourings and the help', { skip }, async () => {
  await s.page.keyboard.press('Escape');
  for (const key of ['1', '4', '3', '2', 'd', 'c']) await s.page.keyboard.press(key);
  assert.equal(await s.page.getAttribute('#cameras [data-camera=follow]', 'aria-pressed'), 'true');
  assert.equal(await s.page.getAttribute('html', 'data-theme'), 'dark');
  await s.page.keyboard.press('?');
  assert.match(await s.text('#help'), /Keys and legend/);
  await s.page.keyboard.press('Escape');
  await s.page.keyboard.press('d');
  await s.page.keyboard.press('c');
  clean();
});

test('plays on at its speed and stops at the end', { skip }, async () => {
  // After a click on a button the space bar still plays.
  await s.page.click('[data-camera=follow]');
  await s.run(() => window.canyon.goTo(110));
  await s.page.selectOption('#speed', '60');
  await s.page.keyboard.press(' ');
  await s.page.waitForFunction(() => !window.canyon.state.playing);
  assert.equal(await s.run('canyon.state.epoch'), 119);
  await s.page.selectOption('#speed', '1');
  clean();
});

test('nothing is cut off at 1280 x 720', { skip }, async () => {
  const over = await s.run(() => [...document.querySelectorAll('header > *, #controls > *, aside')].filter((e) => {
    const b = e.getBoundingClientRect();
    return b.width > 0 && (b.right > innerWidth + 0.5 || b.bottom > innerHeight + 0.5);
  }).map((e) => e.id || e.tagName));
  assert.deepEqual(over, []);
});

test('words of the data are text: none of them runs', { skip }, async () => {
  const evil = '"><img src=x onerror="window.ran = 1"><script>window.ran = 1</script>';
  const { header, files } = withMap(sampleView({ epochs: 2 }));
  const spoilt = (value) => Array.isArray(value) ? value.map(spoilt) : value && typeof value === 'object' ? Object.fromEntries(
    Object.entries(value).map(([key, v]) => [key, ['title', 'name', 'notes', 'id', 'system', 'label', 'unit', 'about', 'material', 'height_source',
      'status', 'placement', 'visibility', 'lock', 'path', 'altitude_above'].includes(key) && (typeof v === 'string' || Array.isArray(v))
      ? (Array.isArray(v) ? v.map((word) => word + evil) : v + evil) : spoilt(v)])) : value;
  const bad = spoilt(header);
  bad.tables = header.tables.map((t) => ({ ...t, columns: t.columns.map((c) => ({ ...c, unit: evil, about: evil })) }));
  bad.city.triangles = evil;
  for (const layer of bad.map.layers) layer.name = layer.name.slice(0, layer.name.indexOf('"'));
  const hostile = await Session.open(fillPage(page, { header: bad, files }));
  try {
    await hostile.run(() => {
      const { state } = window.canyon;
      state.selectSatellite(2);
      document.querySelectorAll('[data-tab]').forEach((tab) => tab.click());
      state.selectObject?.(3);
    });
    await hostile.page.waitForTimeout(200);
    assert.equal(await hostile.run('document.querySelectorAll("img, body script[src]").length'), 0);
    assert.equal(await hostile.run('window.ran'), undefined);
    assert.match(await hostile.run('document.querySelector("#tab-summary").textContent'), /onerror/);
    assert.match(await hostile.run('document.querySelector("#tab-satellites").textContent'), /onerror/);
    // Injected scripts would not run in any case: only the page's own script does.
    await hostile.run(() => {
      document.body.insertAdjacentHTML('beforeend', '<img src="data:," onerror="window.ran = 2">');
      document.body.append(Object.assign(document.createElement('script'), { textContent: 'window.ran = 3' }));
    });
    await hostile.page.waitForTimeout(200);
    assert.equal(await hostile.run('window.ran'), undefined);
  } finally {
    await hostile.close();
  }
});

test('says what is wrong with data of another version', { skip }, async () => {
  const view = sampleView({ epochs: 2 });
  const other = await Session.open(fillPage(page, { ...view, header: { ...view.header, version: 2 } }));
  try {
    assert.match(await other.text('.fatal'), /version 2/);
  } finally {
    await other.close();
  }
});
