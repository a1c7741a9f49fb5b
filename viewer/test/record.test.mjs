// Films of a page: run by `canyon view --record`.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { after, before, test } from 'node:test';
import { kPatience, Session, withoutChromium } from './browser.mjs';
import { fillPage, sampleView } from './sample.mjs';

const skip = withoutChromium;
const page = await readFile(new URL('../dist/viewer.html', import.meta.url), 'utf8');
const script = fileURLToPath(new URL('../record.mjs', import.meta.url));
let folder;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), 'canyon-record-'));
  await writeFile(join(folder, 'page.html'), fillPage(page, sampleView({ grid: 2, epochs: 20 })));
});
after(() => rm(folder, { recursive: true, force: true }));
const record = (wanted) => execFileSync('node', [script, JSON.stringify({ page: join(folder, 'page.html'), folder, width: 640, height: 360,
  fps: 5, ...wanted })], { timeout: 2 * kPatience, encoding: 'latin1' });

test('an animated WebP that a browser plays', { skip }, async () => {
  const webp = join(folder, 'film.webp');
  assert.equal(record({ frames: 3, webp, quality: 60 }), '1\n2\n3\n');
  const s = await Session.open(fillPage(page, sampleView({ grid: 2, epochs: 2 })), { width: 640, height: 360 });
  try {
    const film = await s.run(async (base64) => {
      const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
      const decoder = new ImageDecoder({ data: bytes, type: 'image/webp' });
      await decoder.tracks.ready;
      await decoder.completed;
      const { frameCount, repetitionCount } = decoder.tracks.selectedTrack;
      const { image } = await decoder.decode({ frameIndex: frameCount - 1 });
      return { frameCount, loops: repetitionCount === Infinity, width: image.displayWidth, height: image.displayHeight, us: image.duration };
    }, (await readFile(webp)).toString('base64'));
    assert.deepEqual(film, { frameCount: 3, loops: true, width: 640, height: 360, us: 200_000 });
  } finally {
    await s.close();
  }
});

test('frames of a run show the times that were asked for', { skip }, async () => {
  record({ frames: 2, from: 5, until: 10, camera: 'top' });
  const [first, last] = await Promise.all(['00000.png', '00001.png'].map((name) => readFile(join(folder, name))));
  // PNG, 5.6 and 11.2.2: width and height in IHDR.
  for (const png of [first, last]) assert.deepEqual([png.readUInt32BE(16), png.readUInt32BE(20)], [640, 360]);
  assert.notDeepEqual(first, last);
});
