// A headless Chromium for the tests; they are skipped with a message if there is none.
import { existsSync } from 'node:fs';
import { mkdir, mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { chromium } from 'playwright-core';

export const kChromium = [process.env.CANYON_CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome']
  .find((path) => path && existsSync(path));
/** For `skip:` of a test: false, or the reason. */
export const withoutChromium = kChromium ? false : 'SKIPPED: no Chromium here (Debian: chromium)';
if (withoutChromium) console.error(withoutChromium);
/** The time limit of one step of a test [ms]: a busy machine draws a picture in a second, none takes this long. */
export const kPatience = 30_000;

/** Opens an HTML text or file from disk, or an address; stores the page's errors and network requests. */
export class Session {
  static async open(html, { width = 1280, height = 720, colorScheme = 'light' } = {}) {
    const session = new Session();
    try {
      await session.start(html, { width, height, colorScheme });
    } catch (error) {
      // An open browser would prevent the tests from ending.
      await session.close();
      throw error;
    }
    return session;
  }

  async start(html, { width, height, colorScheme }) {
    this.folder = await mkdtemp(join(tmpdir(), 'canyon-viewer-'));
    const served = html.startsWith('http:');
    const file = served || existsSync(html) ? html : join(this.folder, 'page.html');
    if (file !== html) await writeFile(file, html);
    this.browser = await chromium.launch({
      executablePath: kChromium,
      timeout: kPatience,
      args: ['--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--no-sandbox'],
    });
    this.page = await this.browser.newPage({ viewport: { width, height }, colorScheme });
    this.page.setDefaultTimeout(kPatience);
    this.complaints = [];
    this.requests = [];
    this.page.on('console', (m) => ['error', 'warning'].includes(m.type()) && this.complaints.push(m.text()));
    this.page.on('pageerror', (e) => this.complaints.push(e.message));
    this.page.on('request', (r) => this.requests.push(r.url()));
    const begin = Date.now();
    this.url = served ? html : pathToFileURL(file).href;
    await this.page.goto(this.url);
    await this.page.waitForSelector('body[data-loaded=true], .fatal', { state: 'attached' });
    this.loadedMs = Date.now() - begin;
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
  /** A picture for manual inspection, in test-output/. */
  async picture(name) {
    const folder = new URL('../test-output/', import.meta.url);
    await mkdir(folder, { recursive: true });
    return this.page.screenshot({ path: join(folder.pathname, `${name}.png`) });
  }
  /** Only the page's own address: no network, no other files. */
  foreignRequests() {
    return this.requests.filter((url) => url !== this.url && !url.startsWith('data:') && !url.startsWith('blob:'));
  }
  async close() {
    // A browser that does not respond ends with this process.
    await Promise.race([this.browser?.close().catch(() => {}), new Promise((done) => setTimeout(done, 5000).unref())]);
    await rm(this.folder, { recursive: true, force: true });
  }
}
