// The client of Foxglove Studio and Lichtblick (npm: @foxglove/ws-protocol) as a viewer: subscribes to all that is advertised, until each
// of the topics named behind the address has come COUNT times; prints them as a line of JSON.
//
//     NODE_PATH=FOLDER/node_modules node foxglove_client.cjs ws://127.0.0.1:8765 COUNT TOPIC..
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const WebSocket = require("ws");

const [address, count, ...wanted] = process.argv.slice(2);
const channels = new Map();
const seen = new Map(wanted.map((topic) => [topic, []]));
const client = new FoxgloveClient({ ws: new WebSocket(address, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]) });

function fail(what) {
  console.error(what);
  process.exit(1);
}

client.on("error", fail);
client.on("status", (status) => fail(JSON.stringify(status)));
client.on("close", () => fail("closed before all had come"));
client.on("advertise", (advertised) => {
  for (const channel of advertised) {
    channels.set(client.subscribe(channel.id), channel);
  }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const messages = seen.get(channels.get(subscriptionId).topic);
  messages?.push({ at: Number(timestamp), data: Buffer.from(data.buffer, data.byteOffset, data.byteLength).toString("base64") });
  if ([...seen.values()].every((each) => each.length >= Number(count))) {
    const whole = [...channels.values()].map((channel) => ({ ...channel, messages: seen.get(channel.topic) ?? [] }));
    console.log(JSON.stringify(whole));
    process.exit(0);
  }
});
