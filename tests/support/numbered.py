"""Numbers in turn, sent and heard by rospy and rclpy alike: they tell what was left out, came late or came twice."""
import threading
import time


class Heard:
    """`count`: one more than the greatest number heard. `late`: they came twice or out of order."""
    count = lost = late = 0

    def take(self, message):
        self.lost += max(0, message.data - self.count)
        self.late += message.data < self.count
        self.count = max(self.count, message.data + 1)

    def told(self):
        return [self.count, self.lost, self.late]


def missing(sent, told):
    """Of `sent` numbers those that were not heard, or not yet; told: Heard.told()."""
    count, lost, _ = told
    return sent - count + lost


class Talker(threading.Thread):
    """Sends numbers from 0 on, until end()."""
    count, is_ending = 0, False

    def __init__(self, send, hz):
        super().__init__(daemon=True)
        self.send, self.hz = send, hz
        self.start()

    def run(self):
        begin = time.monotonic()
        while not self.is_ending:
            self.count += 1
            self.send(self.count - 1)
            time.sleep(max(0, begin + self.count / self.hz - time.monotonic()))

    def end(self):
        self.is_ending = True
        self.join()


def hear_the_rest(heard, sent):
    """What waits in queues, as long as anything comes; heard(): as many as were heard until now, to be `sent`."""
    told, since = None, time.monotonic()
    while told != sent and time.monotonic() < since + 10:
        now = heard()
        if now != told:
            told, since = now, time.monotonic()
        time.sleep(0.2)
