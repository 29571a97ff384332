"""A recorder as mongodb_log is one: tests/bench/peers sets it beside recorder_node.

    mongodb_log.py mongodb://HOST TOPIC TYPE

As its code has it, written anew: a queue of 100 messages a topic, of which the oldest is dropped
when it is full; every message decoded to a document of its fields, the time it came to the
millisecond, one insert each. At SIGINT it stores what is queued and prints a line of JSON.
"""
import datetime
import json
import queue
import signal
import sys
import threading

QUEUE_MAX_SIZE = 100


def document(value):
    """Messages as dictionaries, arrays of bytes as they are."""
    import genpy
    if isinstance(value, genpy.Message):
        return {name: document(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, (genpy.Time, genpy.Duration)):
        return {"secs": value.secs, "nsecs": value.nsecs}
    if isinstance(value, (list, tuple)):
        return [document(item) for item in value]
    return value


class Log:
    def __init__(self, uri, topic, kind):
        import pymongo
        import roslib.message
        import rospy
        self.topic, self.type = topic, kind
        self.collection = pymongo.MongoClient(uri)["roslog"][topic.strip("/").replace("/", "_")]
        self.queue, self.ended = queue.Queue(QUEUE_MAX_SIZE), threading.Event()
        self.received = self.dropped = self.stored = 0
        self.writer = threading.Thread(target=self.write, daemon=True)
        self.writer.start()
        rospy.Subscriber(topic, roslib.message.get_message_class(kind), self.on_message)

    def on_message(self, message):
        import rospy
        self.received += 1
        if self.queue.full():
            try:
                self.queue.get_nowait()
                self.dropped += 1
            except queue.Empty:
                pass
        self.queue.put((message, rospy.get_time()))

    def write(self):
        while not (self.ended.is_set() and self.queue.empty()):
            try:
                message, at = self.queue.get(timeout=0.05)
            except queue.Empty:
                continue
            entry = document(message)
            entry["_meta"] = {
                "topic": self.topic,
                "stored_type": self.type,
                "inserted_at": datetime.datetime.utcfromtimestamp(at)
            }
            self.collection.insert_one(entry)
            self.stored += 1

    def end(self):
        self.ended.set()
        self.writer.join()
        return {"received": self.received, "dropped": self.dropped, "stored": self.stored}


def main():
    import rospy
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    ended = threading.Event()
    rospy.init_node("mongodb_log", disable_signals=True)
    signal.signal(signal.SIGINT, lambda *_: ended.set())
    log = Log(*sys.argv[1:])
    while not ended.wait(0.2):
        pass
    print(json.dumps(log.end()))


if __name__ == "__main__":
    main()
