// The synthetic views (sample.mjs), without a browser.
import Ajv from 'ajv';
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { test } from 'node:test';
import { sampleView, withMap, withPair } from './sample.mjs';

const schema = JSON.parse(await readFile(new URL('../schema.json', import.meta.url), 'utf8'));
const validate = new Ajv({ allowUnionTypes: true }).compile(schema);

test('the sample is what the schema says', () => {
  assert.ok(validate(sampleView().header), JSON.stringify(validate.errors));
  assert.ok(!validate({ ...sampleView().header, version: 2 }));
});

test('the sample with a map is what the schema says', () => {
  assert.ok(validate(withMap(sampleView({ epochs: 4 })).header), JSON.stringify(validate.errors));
});

test('the sample of a validation is what the schema says', () => {
  assert.ok(validate(withPair(sampleView()).header), JSON.stringify(validate.errors));
});
