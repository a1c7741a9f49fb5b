// Reads a drive.mcap of `canyon simulate` with npm's @mcap/core and decodes its messages by their schemas with
// npm's @foxglove/rosmsg2-serialization; compares the fixes with epochs.csv beside it.
//   mcap.js CANYON      exit code 77: node or its packages are missing
const { execFileSync } = require('child_process')
const { mkdtempSync, readFileSync, rmSync, writeFileSync } = require('fs')
const { tmpdir } = require('os')
const { join } = require('path')

let McapIndexedReader, McapStreamReader, parse, MessageReader
try {
  ({ McapIndexedReader, McapStreamReader } = require('@mcap/core'));
  ({ parse } = require('@foxglove/rosmsg'));
  ({ MessageReader } = require('@foxglove/rosmsg2-serialization'))
} catch (error) {
  console.log('SKIPPED: npm\'s @mcap/core is missing')
  process.exit(77)
}

const fail = (what) => { console.error(`mcap: ${what}`); process.exit(1) }
const near = (what, a, b, tolerance) => { if (!(Math.abs(a - b) <= tolerance)) fail(`${what}: ${a} and ${b}`) }

// Messages of a receiver's file by topic.
async function topics(folder, receiver) {
  const bytes = readFileSync(join(folder, 'out', receiver, 'drive.mcap'))

  // Without its index: every record, with the checksums of chunks.
  const stream = new McapStreamReader({ validateCrcs: true })
  stream.append(bytes)
  let streamed = 0
  for (let record; (record = stream.nextRecord()); ) if (record.type === 'Message') ++streamed
  if (!stream.done()) fail('it does not end')

  const reader = await McapIndexedReader.Initialize({
    readable: { size: async () => BigInt(bytes.length), read: async (at, size) => bytes.subarray(Number(at), Number(at + size)) }
  })
  const readers = new Map(), messages = new Map()
  for (const channel of reader.channelsById.values()) {
    const schema = reader.schemasById.get(channel.schemaId)
    if (schema.encoding !== 'ros2msg' || channel.messageEncoding !== 'cdr') fail(`encoding of ${channel.topic}`)
    readers.set(channel.id, new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true })))
    messages.set(channel.topic, [])
  }
  let indexed = 0
  for await (const message of reader.readMessages()) {
    ++indexed
    messages.get(reader.channelsById.get(message.channelId).topic).push(readers.get(message.channelId).readMessage(message.data))
  }
  if (indexed !== streamed || BigInt(indexed) !== reader.statistics.messageCount) fail(`${indexed} and ${streamed} messages`)
  return { messages, indexed }
}

async function main() {
  const folder = mkdtempSync(join(tmpdir(), 'canyon-mcap-'))
  try {
    const scenario = join(folder, 's.yaml')
    writeFileSync(scenario, `city: {synthetic: {seed: 3}, origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}}
sky: {nominal: true}
start: 2026-06-01T08:00:00Z
rate_hz: 5
duration_s: 60
trajectory: {waypoints: [{east_m: -228, north_m: 0, up_m: 2}, {east_m: 228, north_m: 0, up_m: 2}], speed_mps: 8, acceleration_mps2: 2}
sensors: {imu: {rate_hz: 100, axes: frd}, wheels: {rate_hz: 20}}
receivers: [{name: base, fixed: {east_m: 10, north_m: 9, up_m: 2}}, {name: car}]
outputs: {mcap: true, pictures: false}
`)
    execFileSync(process.argv[2], ['simulate', scenario, '-o', join(folder, 'out'), '--quiet'], { timeout: 120000 })
    const base = await topics(folder, 'base'), { messages, indexed } = await topics(folder, 'car')
    if (['/imu/data_raw', '/wheels/odometry'].some((topic) => base.messages.has(topic))) fail('a base has the sensors of the car')

    const rows = readFileSync(join(folder, 'out', 'car', 'epochs.csv'), 'utf8').trim().split('\n').map((line) => line.split(','))
    const column = Object.fromEntries(rows.shift().map((name, k) => [name, k]))
    const fixes = messages.get('/fix'), truth = messages.get('/truth')
    if (fixes.length !== rows.length || truth.length !== rows.length) fail('epochs are missing')
    let solved = 0
    rows.forEach((row, k) => {
      const value = (name) => Number(row[column[name]])
      near('speed', Math.hypot(truth[k].twist.twist.linear.x, truth[k].twist.twist.linear.y),
        Math.hypot(value('true_velocity_east_mps'), value('true_velocity_north_mps')), 1e-3)
      if (row[column.status] !== 'fix') {
        if (fixes[k].status.status !== -1 || !Number.isNaN(fixes[k].latitude)) fail('a fix where there is none')
        return
      }
      ++solved
      near('latitude', fixes[k].latitude, value('fix_latitude_deg'), 1e-9)
      near('height', fixes[k].altitude, value('fix_height_m'), 1e-3)
      near('deviation', Math.sqrt(fixes[k].position_covariance[0]), value('sigma_east_m'), 1e-3)
      near('covariance', fixes[k].position_covariance[1], value('covariance_east_north_m2'), 1e-5)
    })
    const speeds = messages.get('/fix_odometry')
    near('velocity', speeds[9].twist.covariance[0], Number(rows[9][column.velocity_covariance_east_m2ps2]), 1e-7)
    const imu = messages.get('/imu/data_raw')
    near('gravity', imu.reduce((sum, each) => sum + each.linear_acceleration.z, 0) / imu.length, 9.8, 0.15)  // frd became flu
    // A tick of 0.02 m at 20 Hz is 0.4 m/s; of scale and slip 0.5 and 0.3 %.
    const wheels = messages.get('/wheels/odometry')
    for (const { twist: { twist, covariance }, pose } of wheels) {
      near('speed by wheels', covariance[0], 0.4 ** 2 / 12 + (0.005 ** 2 + 0.003 ** 2) * twist.linear.x ** 2 / 2, 1e-4)
      near('yaw rate by wheels', covariance[35] / covariance[0], 4 / 1.5 ** 2, 1e-9)
      if (pose.covariance[0] !== 1e6 || pose.covariance[35] !== 1e6) fail('wheels know the pose')
    }
    if (imu.length < 5900 || wheels.length < 1190 || solved < 100) fail('samples are missing')
    console.log(`${indexed} messages of ${messages.size} topics, ${solved} fixes as in epochs.csv`)
  } finally {
    rmSync(folder, { recursive: true, force: true })
  }
}
main().catch((error) => fail(error.stack))
