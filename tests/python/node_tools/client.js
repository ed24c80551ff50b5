// Foxglove's own client (@foxglove/ws-protocol): subscribes to every channel of a server.
// usage: node client.js URL FILE       writes each message as a line {topic, time_ns, message} until all are received
//        node client.js --schemas      prints Foxglove's JSON schemas by name
const fs = require("fs");

if (process.argv[2] === "--schemas") {
  const schemas = require("@foxglove/schemas/jsonschema");
  const named = {};
  for (const [name, schema] of Object.entries(schemas)) named["foxglove." + name] = schema;
  process.stdout.write(JSON.stringify(named), () => process.exit(0));
  return;
}

const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { WebSocket } = require("ws");
const [url, file] = process.argv.slice(2);
const out = fs.openSync(file, "w");
const client = new FoxgloveClient({
  ws: new WebSocket(url, [process.env.SUBPROTOCOL || FoxgloveClient.SUPPORTED_SUBPROTOCOL]),
});
const topics = new Map();
client.on("error", (error) => {
  console.error(String(error));
  process.exit(1);
});
client.on("serverInfo", (info) => fs.writeSync(out, JSON.stringify({ serverInfo: info }) + "\n"));
client.on("advertise", (channels) => {
  for (const channel of channels) {
    topics.set(client.subscribe(channel.id), channel);
    fs.writeSync(out, JSON.stringify({ channel }) + "\n");
  }
});
client.on("time", () => {});
client.on("message", (event) => {
  const channel = topics.get(event.subscriptionId);
  const message = JSON.parse(Buffer.from(event.data.buffer, event.data.byteOffset, event.data.byteLength));
  fs.writeSync(out, JSON.stringify({ topic: channel.topic, time_ns: Number(event.timestamp), message }) + "\n");
  // This is the last message of an episode.
  if (channel.topic === "/episode" && message.end_reason) {
    setTimeout(() => {
      client.close();
      process.exit(0);
    }, 500);
  }
});
