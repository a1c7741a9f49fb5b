// Reads MAVLink frames from standard input with npm's node-mavlink, a decoder of its own, and prints what it finds:
//   PROTOCOL SYSTEM COMPONENT SEQUENCE MESSAGE FIELD=COUNT[,COUNT...] ...
// With a file named it also writes there each message as its own encoder frames it, in the same version.
const fs = require('fs')
const { MavLinkPacketSplitter, MavLinkPacketParser, MavLinkProtocolV1, MavLinkProtocolV2, minimal, common, development } = require('node-mavlink')

const known = { ...minimal.REGISTRY, ...common.REGISTRY, ...development.REGISTRY }
const again = []
const packets = process.stdin.pipe(new MavLinkPacketSplitter()).pipe(new MavLinkPacketParser())
packets.on('data', packet => {
  const { msgid, seq, sysid, compid } = packet.header
  const of = known[msgid]
  if (!of) return
  const data = packet.protocol.data(packet.payload, of)
  const fields = of.FIELDS.map(field => `${field.source}=${[data[field.name]].flat().join(',')}`)
  const first = packet.protocol instanceof MavLinkProtocolV1
  console.log(first ? 'V1' : 'V2', sysid, compid, seq, of.MSG_NAME, ...fields)
  const protocol = first ? new MavLinkProtocolV1(sysid, compid) : new MavLinkProtocolV2(sysid, compid)
  again.push(protocol.serialize(data, seq))
})
packets.on('end', () => { if (process.argv[2]) fs.writeFileSync(process.argv[2], Buffer.concat(again)) })
