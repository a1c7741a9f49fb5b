// Several receivers, and a validation: recorded and simulated (sample.mjs).
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { after, before, test } from 'node:test';
import { Session, withoutChromium } from './browser.mjs';
import { fillPage, sampleView, withPair } from './sample.mjs';

const skip = withoutChromium;
const page = await readFile(new URL('../dist/viewer.html', import.meta.url), 'utf8');
let s;
before(async () => {
  if (!skip) s = await Session.open(fillPage(page, withPair(sampleView())));
});
after(() => s?.close());
const epoch = () => s.run('canyon.state.epoch');

test('to where recorded and simulated differ most, street by street', { skip }, async () => {
  // 30 m at the end of the second street, then 20 m of the third, 10 m of the first, and again from the first.
  for (const [at, metres] of [[79, '30.0'], [119, '20.0'], [39, '10.0'], [79, '30.0']]) {
    await s.page.keyboard.press('v');
    assert.equal(await epoch(), at);
    assert.match(await s.text('#toast'), new RegExp(`differ by ${metres} m \\(rms of 5 satellites\\)`));
  }
  await s.page.keyboard.press('Home');
  await s.page.click('#difference');
  assert.equal(await epoch(), 79);
});

test('pseudorange errors of both over time; of the selected satellite', { skip }, async () => {
  const legend = () => s.page.locator('#chart .u-legend .u-label').allInnerTexts();
  assert.deepEqual((await legend()).slice(1), ['pseudorange errors (rms), recorded:', 'simulated:', 'difference:'].map((t) => t.replace(':', '')));
  await s.page.click('tr[data-satellite="1"]');
  assert.match((await legend())[1], /^G05 pseudorange error, recorded/);
  await s.page.keyboard.press('Escape');
  await s.page.click('[data-chart=error]');
  assert.deepEqual((await legend()).slice(1), ['horizontal error, recorded', 'horizontal error, simulated']);
  assert.deepEqual(s.complaints, []);
});

test('the panels show the receiver that is chosen; the legend names both', { skip }, async () => {
  assert.match(await s.text('#legend'), /fix, recorded\s*fix, simulated/);
  await s.page.selectOption('#receiver', '1');
  assert.equal(await s.run('canyon.state.receiver'), 1);
  assert.equal(await epoch(), 79);  // the same time
  const drawn = () => s.run('canyon.scene.fixMarksShown');
  assert.deepEqual(await drawn(), { disc: 1, square: 1, diamond: 0, triangle: 0 });
  await s.page.click('#layers summary');
  await s.page.click('#layers label:has-text("the other receivers")');
  assert.deepEqual(await drawn(), { disc: 0, square: 1, diamond: 0, triangle: 0 });
  await s.page.click('#layers summary');
  assert.deepEqual(s.complaints, []);
  assert.deepEqual(s.foreignRequests(), []);
});
