// The Foxglove WebSocket protocol's own client (npm): foxglove_client.js MODULES URL PROTOCOL... Commands come as lines of
// JSON on stdin, {"do": "subscribe", ...}; what the server sends goes as lines of JSON to stdout, messages decoded by the
// definitions that it sent. Playback control, which this client does not know, is read and written here.
const path = require("path");
const readline = require("readline");
const need = require("module").createRequire(path.join(path.resolve(process.argv[2]), "client.js"));
const { WebSocket } = need("ws");
const { FoxgloveClient } = need("@foxglove/ws-protocol");
const { parse } = need("@foxglove/rosmsg");
const { MessageReader } = need("@foxglove/rosmsg-serialization");

const began = process.hrtime.bigint();
const tell = (event, told) =>
  console.log(JSON.stringify({ event, s: Number(process.hrtime.bigint() - began) / 1e9, ...told },
    (_, value) => typeof value === "bigint" ? String(value) : ArrayBuffer.isView(value) ? value.length : value));

const channels = new Map(), readers = new Map(), topics = new Map();
const socket = new WebSocket(process.argv[3], process.argv.slice(4));
const client = new FoxgloveClient({ ws: socket });
socket.on("message", (data, isBinary) => {
  const view = Buffer.from(data);
  if (isBinary && view[0] === 5) {
    tell("state", { status: view[1], at: view.readBigUInt64LE(2), speed: view.readFloatLE(10), sought: view[14] === 1,
                    id: view.toString("utf8", 19) });
  }
});
client.on("open", () => tell("open", { protocol: socket.protocol }));
client.on("close", () => { tell("close", {}); process.exit(0); });
client.on("error", error => String(error).includes("opcode in binary message: 5") || tell("error", { text: String(error) }));
client.on("serverInfo", info => tell("serverInfo", info));
client.on("status", status => tell("status", status));
client.on("time", ({ timestamp }) => tell("time", { at: timestamp }));
client.on("parameterValues", values => tell("parameterValues", values));
client.on("advertise", list => {
  for (const channel of list) {
    channels.set(channel.topic, channel);
    readers.set(channel.id, new MessageReader(parse(channel.schema)));
  }
  tell("advertise", { channels: list });
});
client.on("unadvertise", ids => tell("unadvertise", { ids }));
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const channel = topics.get(subscriptionId);
  tell("message", { topic: channel.topic, at: timestamp, bytes: data.byteLength,
                    value: readers.get(channel.id).readMessage(data) });
});

const commands = {
  subscribe: ({ topic }) => topics.set(client.subscribe(channels.get(topic).id), channels.get(topic)),
  get: ({ names }) => client.getParameters(names, "asked"),
  set: ({ name, value }) => client.setParameters([{ name, value }], "set"),
  publish: ({ topic }) => {
    const id = client.advertise({ topic, encoding: "ros1", schemaName: "std_msgs/String" });
    client.sendMessage(id, new Uint8Array([1, 0, 0, 0, 65]));
  },
  control: ({ plays, speed, seek, id }) => {
    const request = Buffer.alloc(19 + id.length);
    request[0] = 3;
    request[1] = plays ? 0 : 1;
    request.writeFloatLE(speed ?? 1, 2);
    request[6] = seek === undefined ? 0 : 1;
    request.writeBigUInt64LE(BigInt(seek ?? 0), 7);
    request.writeUInt32LE(id.length, 15);
    request.write(id, 19);
    socket.send(request);
  },
};
const lines = readline.createInterface({ input: process.stdin });
lines.on("line", line => { const command = JSON.parse(line); commands[command.do](command); });
lines.on("close", () => client.close());
