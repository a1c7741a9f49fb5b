// Frames of a view, in a headless Chromium: run by `canyon view --record`. One argument, JSON:
//   page    an exported page
//   folder  takes the frames, 00000.png and so on
//   webp    an animated WebP is written there instead
//   width, height, frames, fps, from, until, camera
import { existsSync } from 'node:fs';
import { writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const wanted = JSON.parse(process.argv[2]);
const fail = (text) => {
  process.stderr.write(`${text}\n`);
  process.exit(2);
};
const executablePath = [process.env.CANYON_CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome']
  .find((path) => path && existsSync(path));
if (!executablePath) fail('no Chromium here (Debian: chromium; CANYON_CHROMIUM names another)');
const { chromium } = await import('playwright-core').catch(() => fail('the viewer is not installed: ./run view'));

/** Chunks of an image file written by Chromium: [name, bytes]. */
function riffChunks(bytes) {
  const chunks = [];
  for (let at = 12; at + 8 <= bytes.length;) {
    const size = bytes.readUInt32LE(at + 4);
    chunks.push([bytes.toString('latin1', at, at + 4), bytes.subarray(at + 8, at + 8 + size)]);
    at += 8 + size + (size & 1);
  }
  return chunks;
}

function riffChunk(name, bytes) {
  const head = Buffer.alloc(8);
  head.write(name, 'latin1');
  head.writeUInt32LE(bytes.length, 4);
  return Buffer.concat([head, bytes, Buffer.alloc(bytes.length & 1)]);
}

/** Animated WebP of still ones (WebP container specification: VP8X, ANIM, an ANMF for each frame), played in a loop. */
function animatedWebp(frames, width, height, ms) {
  const vp8x = Buffer.alloc(10);
  vp8x[0] = 0x02;  // animation
  vp8x.writeUIntLE(width - 1, 4, 3);
  vp8x.writeUIntLE(height - 1, 7, 3);
  const parts = [riffChunk('VP8X', vp8x), riffChunk('ANIM', Buffer.from([255, 255, 255, 255, 0, 0]))];
  for (const { bytes, times } of frames) {
    const head = Buffer.alloc(16);
    head.writeUIntLE(width - 1, 6, 3);
    head.writeUIntLE(height - 1, 9, 3);
    head.writeUIntLE(ms * times, 12, 3);
    head[15] = 0x02;  // a frame covers the previous one
    const image = riffChunks(bytes).filter(([name]) => ['VP8 ', 'VP8L', 'ALPH'].includes(name)).map(([name, data]) => riffChunk(name, data));
    parts.push(riffChunk('ANMF', Buffer.concat([head, ...image])));
  }
  const body = Buffer.concat([Buffer.from('WEBP', 'latin1'), ...parts]);
  const head = Buffer.alloc(8);
  head.write('RIFF', 'latin1');
  head.writeUInt32LE(body.length, 4);
  return Buffer.concat([head, body]);
}

const browser = await chromium.launch({
  executablePath, args: ['--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--no-sandbox'],
});
try {
  const { width, height, frames } = wanted;
  const page = await browser.newPage({ viewport: { width, height } });
  await page.goto(pathToFileURL(wanted.page).href);
  await page.waitForSelector('body[data-loaded=true], .fatal', { state: 'attached', timeout: 120_000 });
  const fatal = await page.locator('.fatal').allInnerTexts();
  if (fatal.length > 0) throw new Error(fatal[0]);
  const client = await page.context().newCDPSession(page);
  const stills = [];
  for (let i = 0; i < frames; ++i) {
    await page.evaluate((at) => window.canyon.film(at), { share: frames > 1 ? i / (frames - 1) : 0, ...wanted });
    const { data } = await client.send('Page.captureScreenshot', wanted.webp ? { format: 'webp', quality: wanted.quality } : { format: 'png' });
    const bytes = Buffer.from(data, 'base64');
    if (!wanted.webp) await writeFile(join(wanted.folder, `${String(i).padStart(5, '0')}.png`), bytes);
    else if (stills.at(-1)?.bytes.equals(bytes)) stills.at(-1).times += 1;
    else stills.push({ bytes, times: 1 });
    process.stdout.write(`${i + 1}\n`);
  }
  if (wanted.webp) await writeFile(wanted.webp, animatedWebp(stills, width, height, Math.round(1000 / wanted.fps)));
} catch (error) {
  process.stderr.write(`${error.message}\n`);
  process.exitCode = 2;
} finally {
  await browser.close();
}
