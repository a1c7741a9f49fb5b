// A headless Chromium for the tests; they are skipped, and say so, where there is none.
import { existsSync } from 'node:fs';
import { mkdir, mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { chromium } from 'playwright-core';

export const kChromium = [process.env.CANYON_CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome']
  .find((path) => path && existsSync(path));
/** For `skip:` of a test: false, or why. */
export const withoutChromium = kChromium ? false : 'SKIPPED: no Chromium here (Debian: chromium)';

/** Opens an HTML text or file from disk, or an address; what the page complains of, and asks the network for, is kept. */
export class Session {
  static async open(html, { width = 1280, height = 720, colorScheme = 'light' } = {}) {
    const session = new Session();
    session.folder = await mkdtemp(join(tmpdir(), 'canyon-viewer-'));
    const served = html.startsWith('http:');
    const file = served || existsSync(html) ? html : join(session.folder, 'page.html');
    if (file !== html) await writeFile(file, html);
    session.browser = await chromium.launch({
      executablePath: kChromium,
      args: ['--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--no-sandbox'],
    });
    session.page = await session.browser.newPage({ viewport: { width, height }, colorScheme });
    session.page.setDefaultTimeout(120_000);
    session.complaints = [];
    session.requests = [];
    session.page.on('console', (m) => ['error', 'warning'].includes(m.type()) && session.complaints.push(m.text()));
    session.page.on('pageerror', (e) => session.complaints.push(e.message));
    session.page.on('request', (r) => session.requests.push(r.url()));
    const begin = Date.now();
    session.url = served ? html : pathToFileURL(file).href;
    await session.page.goto(session.url);
    await session.page.waitForSelector('body[data-loaded=true], .fatal', { state: 'attached' });
    session.loadedMs = Date.now() - begin;
    return session;
  }

  text(selector) {
    return this.page.locator(selector).first().innerText();
  }
  raw(name) {
    return this.page.locator(`#readout [data-name="${name}"]`).getAttribute('data-raw').then(Number);
  }
  run(script, argument) {
    return this.page.evaluate(script, argument);
  }
  /** A picture for people, in test-output/. */
  async picture(name) {
    const folder = new URL('../test-output/', import.meta.url);
    await mkdir(folder, { recursive: true });
    return this.page.screenshot({ path: join(folder.pathname, `${name}.png`) });
  }
  /** The page's own address and nothing else: no network, no file beside it. */
  foreignRequests() {
    return this.requests.filter((url) => url !== this.url && !url.startsWith('data:') && !url.startsWith('blob:'));
  }
  async close() {
    await this.browser?.close();
    await rm(this.folder, { recursive: true, force: true });
  }
}
