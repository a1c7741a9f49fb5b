// A heat map on the page, with known cells (sample.mjs).
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { after, before, test } from 'node:test';
import { Session, withoutChromium } from './browser.mjs';
import { fillPage, sampleView, withMap } from './sample.mjs';

const skip = withoutChromium;
const page = await readFile(new URL('../dist/viewer.html', import.meta.url), 'utf8');
const view = () => withMap(sampleView({ epochs: 4 }));
let s;
before(async () => {
  if (!skip) s = await Session.open(fillPage(page, view()));
});
after(() => s?.close());

/** The screen position of a point in the city. */
const onScreen = (east, north, up) => s.run(([x, y, z]) => {
  const { scene } = window.canyon;
  const { camera, target } = scene.control;
  const box = document.querySelector('#stage').getBoundingClientRect();
  scene.control.apply(box.width / box.height);
  const p = target.clone().set(x, y, z).project(camera);
  return [box.x + ((p.x + 1) / 2) * box.width, box.y + ((1 - p.y) / 2) * box.height];
}, [east, north, up]);

test('the probe reads the cell under the pointer, with its unit', { skip }, async () => {
  // The free camera from straight above the map, a street between blocks under it: (-76 .. -68, -100 .. 100) has no building.
  await s.page.keyboard.press('3');
  await s.run(() => { window.canyon.scene.control.target.set(-72, 0, 0); window.canyon.scene.request(); });
  // Cell (12, 12): east -80 .. -70, north 20 .. 30: 1.2 m at the first time.
  const at = await onScreen(-73, 25, 1.5);
  await s.page.mouse.move(...at);
  assert.equal(await s.text('#map-probe'), '1.20 m');
  await s.page.mouse.click(...at);
  assert.equal(await s.text('[data-layer=horizontal_error]'), '1.20 m');
  assert.equal(await s.text('[data-layer=availability]'), '1200 %');  // the made-up row 12, times 100
  await s.page.mouse.move(...(await onScreen(-73, -75, 1.5)));
  assert.equal(await s.text('#map-probe'), 'inside a building');
  await s.page.mouse.move(...(await onScreen(-73, 95, 1.5)));
  assert.match(await s.text('#map-probe'), /^no value/);
  assert.deepEqual(s.complaints, []);
});

test('times, altitudes, layers, colours and their range are chosen', { skip }, async () => {
  const at = await onScreen(-73, 25, 1.5);
  await s.page.mouse.move(...at);
  await s.page.keyboard.press('.');
  await s.page.waitForFunction(() => document.querySelector('#map-time').value === '1');
  assert.equal(await s.text('[data-layer=horizontal_error]'), '2.20 m');
  await s.page.selectOption('#map-altitude', '1');
  await s.page.waitForFunction(() => /50 m above the terrain/.test(document.querySelector('#tab-details').innerText));
  const shown = () => s.run(() => {
    const { mesh } = window.canyon.heat;
    const i = 4 * (12 * 40 + 12);
    return [...mesh.material.map.image.data.slice(i, i + 4)];
  });
  // 2.2 m of 0 to 4 m: 0.55 of 64 steps, 35, of grey 255 * 35 / 64.
  assert.deepEqual(await shown(), [139, 139, 139, 255]);
  await s.page.fill('#map-high', '2.2');
  await s.page.keyboard.press('Tab');
  assert.deepEqual(await shown(), [255, 255, 255, 255]);
  // An invalid range is reported, not shown.
  await s.page.fill('#map-low', '3');
  await s.page.keyboard.press('Tab');
  assert.match(await s.run(() => document.querySelector('#map-high').validationMessage), /from a smaller number to a larger/);
  assert.deepEqual(await shown(), [255, 255, 255, 255]);
  await s.page.fill('#map-low', '0');
  await s.page.keyboard.press('Tab');
  assert.equal(await s.run(() => document.querySelector('#map-high').validationMessage), '');
  await s.page.selectOption('#map-colours', 'other');
  assert.deepEqual(await shown(), [0, 0, 0, 255]);
  await s.page.click('#map-reset');
  assert.deepEqual(await shown(), [139, 139, 139, 255]);
  await s.page.selectOption('#map-layer', '1');
  await s.page.waitForFunction(() => window.canyon.heat.layer === 1);
  // Row 12 of 0 to 20 by the square root, 0.7746, inverted: 14 of 64.
  assert.deepEqual(await shown(), [56, 56, 56, 255]);
  await s.page.keyboard.press('Escape');
  await s.page.focus('#play');
  await s.page.keyboard.press('m');
  assert.equal(await s.run('canyon.heat.mesh.visible'), false);
  await s.page.keyboard.press('m');
  await s.picture('map');
  assert.deepEqual(s.complaints, []);
  assert.deepEqual(s.foreignRequests(), []);
});
