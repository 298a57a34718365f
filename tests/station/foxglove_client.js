// An independent client of /foxglove (@foxglove/ws-protocol, a process of its own).
//
//   npm ci --prefix tests/station                      `./hm test` does it; src/hm/station/foxglove_peer_test.cpp finds it
//   node foxglove_client.js URL SUBPROTOCOL            subscribes to every channel; prints a JSON line per channel
//                                                      {topic, schema, stamp_ns, message} for the first message of each
//                                                      and ends when it has one of each, or after 60 s with exit code 1
'use strict'
const { FoxgloveClient } = require('@foxglove/ws-protocol')
const { WebSocket } = require('ws')

const [url, subprotocol] = process.argv.slice(2)
const client = new FoxgloveClient({ ws: new WebSocket(url, [subprotocol]) })
const channels = new Map()  // by subscription
let missing = Infinity

client.on('error', (error) => { console.error(String(error)); process.exit(1) })
client.on('serverInfo', (info) => console.log(JSON.stringify({ server: info.name, session: info.sessionId })))
client.on('status', (status) => { console.error(status.message); process.exit(1) })
client.on('advertise', (advertised) => {
  missing = advertised.length
  for (const channel of advertised) {
    JSON.parse(channel.schema)
    if (channel.encoding !== 'json' || channel.schemaEncoding !== 'jsonschema') throw new Error(channel.topic)
    channels.set(client.subscribe(channel.id), channel)
  }
})
client.on('message', ({ subscriptionId, timestamp, data }) => {
  const channel = channels.get(subscriptionId)
  if (!channel) return
  client.unsubscribe(subscriptionId)
  channels.delete(subscriptionId)
  const message = JSON.parse(Buffer.from(data.buffer, data.byteOffset, data.byteLength).toString())
  console.log(JSON.stringify({ topic: channel.topic, schema: channel.schemaName, stamp_ns: Number(timestamp), message }))
  if (--missing === 0) process.exit(0)
})
setTimeout(() => { console.error('not every channel gave a message'); process.exit(1) }, 60000)
