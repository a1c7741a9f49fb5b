// The page's time, in a headless Chromium with SwiftShader at 1280 x 720: `npm run bench [-- BUILDINGS_A_SIDE...]`, or, of a
// long drive, `npm run bench -- hour [PAGE.html | ADDRESS]` (synthetic by default). Machines are shared, so
// processor time of all of Chromium's processes is printed with wall time.
import { readdirSync, readFileSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { Session } from './browser.mjs';
import { fillPage, sampleView } from './sample.mjs';

const kTicks = 100;  // of /proc per second
const page = await readFile(new URL('../dist/viewer.html', import.meta.url), 'utf8');

/** Processor seconds of this process's descendants. */
function busy() {
  const parents = new Map();
  const seconds = new Map();
  for (const pid of readdirSync('/proc').filter((name) => /^[0-9]+$/.test(name))) {
    try {
      const fields = readFileSync(`/proc/${pid}/stat`, 'utf8').replace(/^.*\) /, '').split(' ');
      parents.set(pid, fields[1]);
      seconds.set(pid, (Number(fields[11]) + Number(fields[12])) / kTicks);
    } catch {
      // It has ended.
    }
  }
  const own = (pid) => (pid === String(process.pid) ? true : parents.has(pid) ? own(parents.get(pid)) : false);
  return [...seconds].filter(([pid]) => pid !== String(process.pid) && own(pid)).reduce((sum, [, s]) => sum + s, 0);
}

async function timed(count, run) {
  const [cpu, wall] = [busy(), performance.now()];
  await run(count);
  return `${((1000 * (busy() - cpu)) / count).toFixed(0)} ms of processor time, ${((performance.now() - wall) / count).toFixed(0)} ms`;
}

/** Resident memory [MB] of the page's process: the largest renderer. */
function resident() {
  let most = 0;
  for (const pid of readdirSync('/proc').filter((name) => /^[0-9]+$/.test(name))) {
    try {
      if (!readFileSync(`/proc/${pid}/cmdline`, 'utf8').includes('--type=renderer')) continue;
      most = Math.max(most, Number(/VmRSS:\s+(\d+)/.exec(readFileSync(`/proc/${pid}/status`, 'utf8'))?.[1] ?? 0) / 1024);
    } catch {
      // It has ended.
    }
  }
  return most.toFixed(0);
}

/** An hour at 10 Hz with 40 satellites: memory and time to open it, and after stepping through all of it in steps of 6 s. */
async function hour(given) {
  const html = given ?? fillPage(page, sampleView({ epochs: 36_000, block: 64, interval: 0.1, more: 28 }));
  const s = await Session.open(html);
  const heap = () => s.run('performance.memory.usedJSHeapSize').then((bytes) => (bytes / 1e6).toFixed(0));
  const { epochs, unpacked } = await s.run(() => {
    const { store } = window.canyon;
    return { epochs: store.tracks[0].size, unpacked: store.header.chunks.reduce((sum, c) => sum + c.bytes, 0) };
  });
  console.log(`${given ?? `made up, a page of ${(html.length / 1e6).toFixed(0)} MB`}: ${epochs} epochs, unpacked ${(unpacked / 1e6).toFixed(0)} MB`);
  console.log(`  first picture after ${(s.loadedMs / 1000).toFixed(1)} s; JavaScript heap ${await heap()} MB, the page's process ${resident()} MB`);
  let most = 0;
  for (let e = 0; e < epochs; e += 60) {
    await s.run(async (epoch) => {
      const { store } = window.canyon;
      window.canyon.goTo(store.tracks[0].time[epoch]);
      await store.load(0, epoch);
    }, e);
    most = Math.max(most, Number(resident()));
  }
  const epoch = await timed(20, (n) => s.run(async (count) => {
    const { store } = window.canyon;
    const { time } = store.tracks[0];
    for (let i = count; i > 0; --i) {
      window.canyon.goTo(time[time.length - i]);
      await new Promise((done) => requestAnimationFrame(done));
    }
  }, n));
  console.log(`  going through it: at most ${most} MB; after it JavaScript heap ${await heap()} MB, the page's process ${resident()} MB, ${
    await s.run('canyon.store.loadedBlocks(0).length')} blocks kept; an epoch on: ${epoch}`);
  await s.close();
}

if (process.argv[2] === 'hour') {
  await hour(process.argv[3]);
  process.exit(0);
}
for (const grid of process.argv.slice(2).map(Number).concat(process.argv.length > 2 ? [] : [8, 142])) {
  const html = fillPage(page, sampleView({ grid }));
  const begun = performance.now();
  const s = await Session.open(html);
  console.log(`${grid * grid} buildings, open after ${((performance.now() - begun) / 1000).toFixed(1)} s with the browser's start`);
  const turn = (count) => s.run(async (n) => {
    const { scene } = window.canyon;
    scene.measuring = true;
    for (let i = 0; i < n; ++i) {
      scene.control.azimuth += 1;
      scene.request();
      scene.frame();
      await new Promise((done) => requestAnimationFrame(done));
    }
    scene.measuring = false;
  }, count);
  await turn(5);
  console.log(`  a picture, camera following: ${await timed(40, turn)}`);
  await s.run(() => {
    const { scene, state } = window.canyon;
    state.camera = 'free';
    state.changed('camera');
    scene.control.distance = 1.1 * Math.max(scene.city.high[0] - scene.city.low[0], 300);
  });
  await turn(5);
  console.log(`  a picture of the whole city: ${await timed(20, turn)}`);
  console.log(`  drawn: ${JSON.stringify(await s.run('window.canyon.scene.drawn'))}`);
  const heap = await s.run('performance.memory.usedJSHeapSize');
  console.log(`  JavaScript heap: ${(heap / 1e6).toFixed(0)} MB`);
  await s.close();
}
process.exit(0);
