// Prints a recorded run as JSON, one record a line, read by Foxglove's own libraries:
//   node read_run.mjs FILE
// First what the file says about itself, then every message in the order of log time.

import { readFile } from "node:fs/promises";
import { McapIndexedReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import zstd from "@foxglove/wasm-zstd";

const bytes = await readFile(process.argv[2]);
await zstd.isLoaded;
const reader = await McapIndexedReader.Initialize({
  readable: {
    size: async () => BigInt(bytes.length),
    read: async (offset, length) => new Uint8Array(bytes.subarray(Number(offset), Number(offset + length))),
  },
  decompressHandlers: { zstd: (data, size) => zstd.decompress(data, Number(size)) },
});

const plain = (value) => {
  if (typeof value === "bigint") return value.toString();
  if (typeof value === "number" && !Number.isFinite(value)) return String(value);
  if (ArrayBuffer.isView(value)) return Array.from(value, plain);
  if (Array.isArray(value)) return value.map(plain);
  if (value instanceof Map) return Object.fromEntries([...value].map(([k, v]) => [k, plain(v)]));
  if (value !== null && typeof value === "object") {
    return Object.fromEntries(Object.entries(value).map(([k, v]) => [k, plain(v)]));
  }
  return value;
};
const print = (value) => process.stdout.write(JSON.stringify(plain(value)) + "\n");

const metadata = [];
for await (const record of reader.readMetadata()) {
  metadata.push({ name: record.name, metadata: record.metadata });
}
print({
  header: reader.header,
  statistics: reader.statistics,
  metadata,
  channels: [...reader.channelsById.values()].map((channel) => {
    const schema = reader.schemasById.get(channel.schemaId);
    return {
      topic: channel.topic,
      messageEncoding: channel.messageEncoding,
      metadata: channel.metadata,
      schema: schema.name,
      schemaEncoding: schema.encoding,
    };
  }),
});

const readers = new Map();
for (const channel of reader.channelsById.values()) {
  const schema = reader.schemasById.get(channel.schemaId);
  const definition = parse(new TextDecoder().decode(schema.data), { ros2: true });
  readers.set(channel.id, new MessageReader(definition));
}
for await (const record of reader.readMessages()) {
  print({
    topic: reader.channelsById.get(record.channelId).topic,
    logTime: record.logTime,
    publishTime: record.publishTime,
    message: readers.get(record.channelId).readMessage(record.data),
  });
}
