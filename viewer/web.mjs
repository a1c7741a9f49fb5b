// Builds Canyon in one page, dist/web.html: node web.mjs MODULE_FOLDER (built by adapters/web/CMakeLists.txt).
import { build } from 'esbuild';
import { createHash } from 'node:crypto';
import { readFile, writeFile } from 'node:fs/promises';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';

const here = dirname(fileURLToPath(import.meta.url));
const made = process.argv[2];
const bundle = await build({
  absWorkingDir: here, entryPoints: ['src/web.ts', 'src/web_worker.ts'], bundle: true, minify: true, format: 'iife', target: ['es2022'],
  write: false, legalComments: 'none', outdir: 'dist', loader: { '.css': 'css' },
});
const safe = (text) => text.replaceAll('</script', '<\\/script');
const text = (ending) => safe(bundle.outputFiles.find((file) => file.path.endsWith(ending)).text);
const data = (id, content) => `<script type="text/plain" id="${id}">${content}</script>`;
const viewer = await readFile(join(here, 'dist/viewer.html'), 'utf8');
const script = text('web.js');
const hashes = [/script-src '(sha256-[^']+)'/.exec(viewer)[1], `sha256-${createHash('sha256').update(script).digest('base64')}`];
const parts = [
  data('canyon-demo', await readFile(join(here, '../examples/synthetic_drive.yaml'), 'utf8')),
  data('canyon-module', safe(await readFile(join(made, 'canyon.js'), 'utf8'))),
  data('canyon-worker', text('web_worker.js')),
  data('canyon-viewer', Buffer.from(viewer).toString('base64')),
  data('canyon-wasm', gzipSync(await readFile(join(made, 'canyon.wasm')), { level: 9 }).toString('base64')),
];
const html = (await readFile(join(here, 'src/web.html'), 'utf8'))
  .replace('<!--canyon:hashes-->', () => hashes.map((hash) => `'${hash}'`).join(' '))
  .replace('<!--canyon:style-->', () => `<style>${bundle.outputFiles.find((file) => file.path.endsWith('.css')).text}</style>`)
  .replace('<!--canyon:data-->', () => parts.join('\n'))
  .replace('<!--canyon:script-->', () => `<script>${script}</script>`);
await writeFile(join(here, 'dist/web.html'), html);
console.log(`dist/web.html: ${(html.length / 1e6).toFixed(2)} MB`);
