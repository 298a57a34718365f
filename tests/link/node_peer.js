// An independent MAVLink implementation (node-mavlink, a process of its own) against which src/hm/link is tested.
//
//   npm ci --prefix tests/link               `./hm test` does it; src/hm/link/node_peer_test.cpp then finds it
//   node node_peer.js vectors > FILE         writes the frames that mavlink_vectors_test.cpp reads without node
//   node node_peer.js live PORT              talks over UDP to a peer at 127.0.0.1:PORT, until standard input ends
//
// live: what system 1, component 77 sends is decoded, encoded anew and sent back. ODOMETRY of any other component is
// judged by the rules of PX4 and ArduPilot and answered by STATUSTEXT; commands are acknowledged when they come a second
// time, so that the sender has to repeat them; TIMESYNC is answered by a clock that is 1000 s ahead.
'use strict'
const dgram = require('dgram')
const { MavLinkProtocolV2, MavLinkPacketSplitter, MavLinkPacketParser } = require('node-mavlink')
const { minimal, common, standard } = require('mavlink-mappings')

const REGISTRY = { ...standard.REGISTRY, ...common.REGISTRY, ...minimal.REGISTRY }
const MESSAGES = [0, 1, 20, 21, 22, 23, 30, 31, 32, 43, 44, 48, 69, 76, 77, 82, 84, 102, 111, 147, 148, 245, 253, 331, 93, 107, 75]
const KEY = Buffer.from(Array.from({ length: 32 }, (_, i) => i))  // of the signed vectors
const IFLAG_SIGNED = 1

// Numerical Recipes' linear congruential generator: the same vectors in every run.
let state = 1
function random () {
  state = (Math.imul(state, 1664525) + 1013904223) >>> 0
  return state / 4294967296
}

function randomNumber (type) {
  switch (type) {
    case 'float': return Math.fround((random() - 0.5) * 2000)
    case 'uint8_t': case 'uint8_t_mavlink_version': return Math.floor(random() * 256)
    case 'int8_t': return Math.floor(random() * 256) - 128
    case 'uint16_t': return Math.floor(random() * 65536)
    case 'int16_t': return Math.floor(random() * 65536) - 32768
    case 'uint32_t': return Math.floor(random() * 4294967296)
    case 'int32_t': return Math.floor(random() * 4294967296) - 2147483648
    case 'uint64_t': return BigInt(Math.floor(random() * 2 ** 52)) * 4096n
    case 'int64_t': return (BigInt(Math.floor(random() * 2 ** 52)) - 2n ** 51n) * 2048n
    default: throw new Error(`no type ${type}`)
  }
}

function randomField (field) {
  if (field.type === 'char[]') {
    const length = Math.floor(random() * (field.length + 1))
    return Array.from({ length }, () => String.fromCharCode(97 + Math.floor(random() * 26))).join('')
  }
  if (!field.type.endsWith('[]')) return randomNumber(field.type)
  return Array.from({ length: field.length }, () => randomNumber(field.type.slice(0, -2)))
}

const zeroField = field => field.type === 'char[]' ? '' : field.type.endsWith('[]')
  ? new Array(field.length).fill(field.type.includes('64') ? 0n : 0)
  : field.type.includes('64') ? 0n : 0

function makeMessage (clazz, isSet) {
  const message = new clazz()
  clazz.FIELDS.forEach((field, i) => { message[field.name] = isSet(field, i) ? randomField(field) : zeroField(field) })
  return message
}

// "name=value": numbers as they are, floats by their bits, arrays with commas, letters by their codes.
function fieldText (field, value) {
  const one = (type, v) => {
    if (type !== 'float') return v.toString()
    const bytes = Buffer.alloc(4)
    bytes.writeFloatLE(v)
    return '0x' + bytes.readUInt32LE().toString(16)
  }
  const type = field.type.replace('[]', '')
  if (type === 'char') {
    value = Array.from({ length: field.length }, (_, i) => i < value.length ? value.charCodeAt(i) : 0)
  }
  return `${field.source}=${(Array.isArray(value) ? value : [value]).map(v => one(type, v)).join(',')}`
}

function writeVectors () {
  console.log('# Frames of node-mavlink 2.3.0: name, sequence, system, component, signed, bytes, fields. See node_peer.js.')
  let sequence = 0
  for (const id of MESSAGES) {
    const clazz = REGISTRY[id]
    const variants = [() => true, field => !field.extension, (_, i) => i === 0, () => random() < 0.5]
    variants.forEach((isSet, variant) => {
      const message = makeMessage(clazz, isSet)
      const isSigned = variant === 3
      const protocol = new MavLinkProtocolV2(sequence % 250 + 1, variant + 1, isSigned ? IFLAG_SIGNED : 0)
      let bytes = protocol.serialize(message, sequence)
      if (isSigned) bytes = protocol.sign(bytes, 7, KEY, Date.UTC(2026, 0, 1) + sequence)
      const fields = clazz.FIELDS.map(field => fieldText(field, message[field.name]))
      console.log([clazz.MSG_NAME, sequence, sequence % 250 + 1, variant + 1, isSigned ? 1 : 0, bytes.toString('hex'),
        ...fields].join(' '))
      sequence = (sequence + 1) & 255
    })
  }
}

// What the two autopilots do with ODOMETRY (PX4: mavlink_receiver and EKF2's buffers; ArduPilot: handle_odometry).
const FRAMES_OF_PX4 = [1, 20]          // LOCAL_NED, LOCAL_FRD
const CHILD_FRAMES_OF_PX4 = [1, 20, 8, 12]
const ESTIMATORS_OF_PX4 = [0, 1, 2, 3, 6]  // unknown, naive, vision, visual-inertial, motion capture
function judge (message, last) {
  const finite = [message.x, message.y, message.z, ...message.q].every(Number.isFinite)
  const stampIsOld = last.stamp !== null && message.timeUsec <= last.stamp
  let px4 = 'accepted'
  if (!FRAMES_OF_PX4.includes(message.frameId)) px4 = 'wrong frame'
  else if (!CHILD_FRAMES_OF_PX4.includes(message.childFrameId)) px4 = 'wrong child frame'
  else if (!ESTIMATORS_OF_PX4.includes(message.estimatorType)) px4 = 'wrong estimator type'
  else if (!finite) px4 = 'not finite'
  else if (stampIsOld) px4 = 'old stamp'
  let ardupilot = 'accepted'
  if (message.frameId !== 20 || message.childFrameId !== 12) ardupilot = 'wrong frame'
  else if (!finite) ardupilot = 'not finite'
  else if (stampIsOld) ardupilot = 'old stamp'
  if (px4 === 'accepted' || ardupilot === 'accepted') last.stamp = message.timeUsec
  return `px4 ${px4}, ardupilot ${ardupilot}`
}

function live (port) {
  const socket = dgram.createSocket('udp4')
  const protocol = new MavLinkProtocolV2(2, 1)
  const last = { stamp: null }
  const seen = new Map()  // command -> how often it came
  let sequence = 0
  const send = (message, from = protocol) => {
    socket.send(from.serialize(message, sequence), port, '127.0.0.1')
    sequence = (sequence + 1) & 255
  }
  const handlers = {
    TIMESYNC: message => {
      if (message.tc1 !== 0n) return
      const answer = makeMessage(REGISTRY[111], () => false)
      answer.tc1 = process.hrtime.bigint() + 1000000000000n
      answer.ts1 = message.ts1
      send(answer)
    },
    ODOMETRY: message => {
      const answer = makeMessage(REGISTRY[253], () => false)
      answer.severity = 6
      answer.text = judge(message, last)
      send(answer)
    },
    COMMAND_LONG: message => {
      const count = (seen.get(message.command) || 0) + 1
      seen.set(message.command, count)
      if (count < 2 || message.confirmation !== count - 1) return
      const answer = makeMessage(REGISTRY[77], () => false)
      answer.command = message.command
      answer.result = 0
      answer.targetSystem = 1
      send(answer)
    }
  }
  const splitter = new MavLinkPacketSplitter()
  splitter.pipe(new MavLinkPacketParser()).on('data', packet => {
    const clazz = REGISTRY[packet.header.msgid]
    if (!clazz) return
    const message = packet.protocol.data(packet.payload, clazz)
    if (packet.header.compid === 77) send(message, new MavLinkProtocolV2(2, 77))
    else if (handlers[clazz.MSG_NAME]) handlers[clazz.MSG_NAME](message)
  })
  socket.on('message', bytes => splitter.write(bytes))
  socket.bind(0, '127.0.0.1', () => {
    const heartbeat = makeMessage(REGISTRY[0], () => false)
    heartbeat.type = 2
    heartbeat.autopilot = 12
    heartbeat.mavlinkVersion = 3
    setInterval(() => send(heartbeat), 100)
    send(heartbeat)
  })
  process.stdin.on('end', () => process.exit(0)).resume()
}

if (process.argv[2] === 'vectors') writeVectors()
else if (process.argv[2] === 'live' && process.argv[3]) live(Number(process.argv[3]))
else {
  console.error('node_peer.js vectors | live PORT')
  process.exit(2)
}
