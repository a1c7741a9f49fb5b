// Builds the viewer into one HTML file, dist/viewer.html: with script and styles inside, nothing is loaded.
import { build } from 'esbuild';
import { createHash } from 'node:crypto';
import { mkdir, readFile, writeFile } from 'node:fs/promises';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const bundle = await build({
  absWorkingDir: here,
  entryPoints: ['src/main.ts'],
  bundle: true,
  minify: true,
  format: 'iife',
  target: ['es2022'],
  write: false,
  legalComments: 'none',
  outdir: 'dist',
  loader: { '.css': 'css' },
});
const text = (ending) => bundle.outputFiles.find((file) => file.path.endsWith(ending)).text;
// A <script> must not contain "</script"; the escaped string is equivalent.
const script = text('.js').replaceAll('</script', '<\\/script');
const html = (await readFile(join(here, 'src/index.html'), 'utf8'))
  // No other script runs, for any data.
  .replace('<!--canyon:hash-->', () => createHash('sha256').update(script).digest('base64'))
  .replace('<!--canyon:style-->', () => `<style>${text('.css')}</style>`)
  .replace('<!--canyon:script-->', () => `<script>${script}</script>`);
await mkdir(join(here, 'dist'), { recursive: true });
await writeFile(join(here, 'dist/viewer.html'), html);
console.log(`dist/viewer.html: ${(html.length / 1e6).toFixed(2)} MB`);
