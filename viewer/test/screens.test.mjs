// Pictures of the page compared with earlier ones (screens.json: mean colours of a grid over the three-dimensional view, free of
// fonts); other sizes of screens. UPDATE=1 rewrites screens.json: check test-output/ before it is committed.
import assert from 'node:assert/strict';
import { readFile, writeFile } from 'node:fs/promises';
import { test } from 'node:test';
import { Session, withoutChromium } from './browser.mjs';
import { fillPage, sampleView, withMap, withPair } from './sample.mjs';

const skip = withoutChromium;
const page = await readFile(new URL('../dist/viewer.html', import.meta.url), 'utf8');
const file = new URL('screens.json', import.meta.url);
const known = JSON.parse(await readFile(file, 'utf8').catch(() => '{}'));
const [kAcross, kAlong] = [34, 21];
/** Tolerance of a cell's mean colour, of 255, and fraction of cells beyond it: edges fall on other pixels on other machines. */
const kTolerance = 12;
const kOdd = 0.03;

/** Mean colours of the view, row by row. */
const means = (s) => s.run(([across, along]) => {
  const { scene } = window.canyon;
  scene.sharpen();
  scene.frame();
  const small = new OffscreenCanvas(across * 8, along * 8).getContext('2d', { willReadFrequently: true });
  small.drawImage(document.querySelector('#stage canvas'), 0, 0, across * 8, along * 8);
  const { data } = small.getImageData(0, 0, across * 8, along * 8);
  const sums = new Float64Array(3 * across * along);
  for (let i = 0; i < data.length; i += 4) {
    const x = Math.floor(((i / 4) % (across * 8)) / 8);
    const y = Math.floor(i / 4 / (across * 8) / 8);
    for (let k = 0; k < 3; ++k) sums[3 * (y * across + x) + k] += data[i + k] / 64;
  }
  return [...sums].map(Math.round);
}, [kAcross, kAlong]);

async function compare(s, name) {
  const shown = await means(s);
  await s.picture(name);
  if (process.env.UPDATE) {
    known[name] = shown;
    await writeFile(file, JSON.stringify(known) + '\n');
    return;
  }
  assert.equal(known[name]?.length, shown.length, `${name} is not in screens.json`);
  const odd = shown.filter((value, i) => Math.abs(value - known[name][i]) > kTolerance).length / shown.length;
  assert.ok(odd <= kOdd, `${name}: ${(100 * odd).toFixed(1)} % of the picture differs; look at test-output/${name}.png`);
}

async function open(view, options) {
  const s = await Session.open(fillPage(page, view), options);
  return s;
}

test('a drive, by day and by night, from above and from the antenna', { skip }, async () => {
  const s = await open(sampleView());
  try {
    await s.run(() => window.canyon.goTo(30));
    await compare(s, 'drive');
    await s.page.keyboard.press('3');
    await compare(s, 'drive-top');
    await s.page.keyboard.press('4');
    await s.page.keyboard.press('d');
    await compare(s, 'drive-first-dark');
    // The comparison can fail: another picture differs.
    await s.page.keyboard.press('2');
    if (!process.env.UPDATE) await assert.rejects(compare(s, 'drive-top'), /differs/);
    assert.deepEqual(s.complaints, []);
  } finally {
    await s.close();
  }
});

test('a heat map from above; a validation', { skip }, async () => {
  for (const [view, name] of [[withMap(sampleView({ epochs: 4 })), 'map-top'], [withPair(sampleView()), 'validation-top']]) {
    const s = await open(view);
    try {
      await s.page.keyboard.press('3');
      await compare(s, name);
    } finally {
      await s.close();
    }
  }
});

for (const [name, width, height] of [['projector', 1280, 720], ['tablet upright', 820, 1180], ['tablet', 1024, 768], ['small window', 700, 600], ['tiny window', 500, 420]]) {
  test(`${name}, ${width} x ${height}: all is within reach`, { skip }, async () => {
    const view = withPair(sampleView());
    view.header.title = 'A drive with a long name, recorded and simulated, through the streets of a town';
    const s = await open(view, { width, height });
    try {
      const over = await s.run(() => [...document.querySelectorAll('header > *, #controls > *, #tabs > *, #stage, aside')].filter((e) => {
        const b = e.getBoundingClientRect();
        return b.width > 0 && (b.right > innerWidth + 0.5 || b.left < -0.5 || b.bottom > Math.max(innerHeight, document.body.scrollHeight) + 0.5);
      }).map((e) => e.id || e.tagName));
      assert.deepEqual(over, []);
      const { width: w, height: h } = await s.page.locator('#stage').boundingBox();
      if (height > 500) assert.ok(w > 300 && h > 150, `${w} x ${h} for the city`);
      const bar = await s.page.locator('#timeline').boundingBox();
      assert.ok(bar.width > 100, `${bar.width} for the time bar`);
      assert.deepEqual(s.complaints, []);
      await s.picture(name.replace(' ', '-'));
    } finally {
      await s.close();
    }
  });
}
