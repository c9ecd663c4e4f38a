// A renderer written from docs/protocol.md alone, with libzmq and the C library of MessagePack (Debian: libzmq3-dev,
// libmsgpack-dev). It subscribes, holds the lease, moves the virtual object, stops.
//
//   c++ -std=c++17 -O2 -Wall -Wextra renderer.cpp -o renderer -lzmq -lmsgpackc
//   ./renderer ipc DIR/RIG            on the daemon's machine
//   ./renderer tcp HOST:PORT KEY      with a key file of `rtctl keys new`
//
// Prints one JSON object; exits 1 when anything is not as the document says.

#include <msgpack.h>
#include <zmq.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

double now_s() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }

void must(bool condition, const std::string &what) {
  if (!condition) throw std::runtime_error(what);
}

// -- MessagePack ---------------------------------------------------------------------------------------------

class Packed {
 public:
  explicit Packed(size_t keys) {
    msgpack_sbuffer_init(&buffer_);
    msgpack_packer_init(&packer_, &buffer_, msgpack_sbuffer_write);
    msgpack_pack_map(&packer_, keys);
  }
  ~Packed() { msgpack_sbuffer_destroy(&buffer_); }
  Packed(const Packed &) = delete;
  Packed &operator=(const Packed &) = delete;

  Packed &text(const char *key, const std::string &value) { return name(key).put(value); }
  Packed &whole(const char *key, int64_t value) {
    name(key);
    msgpack_pack_int64(&packer_, value);
    return *this;
  }
  Packed &numbers(const char *key, const std::vector<double> &values) {
    name(key);
    msgpack_pack_array(&packer_, values.size());
    for (double value : values) msgpack_pack_double(&packer_, value);
    return *this;
  }
  const char *data() const { return buffer_.data; }
  size_t size() const { return buffer_.size; }

 private:
  Packed &name(const char *key) { return put(key); }
  Packed &put(const std::string &value) {
    msgpack_pack_str(&packer_, value.size());
    msgpack_pack_str_body(&packer_, value.data(), value.size());
    return *this;
  }
  msgpack_sbuffer buffer_;
  msgpack_packer packer_;
};

class Unpacked {
 public:
  explicit Unpacked(std::string bytes) : bytes_(std::move(bytes)) {  // texts point into the bytes
    msgpack_unpacked_init(&result_);
    must(msgpack_unpack_next(&result_, bytes_.data(), bytes_.size(), nullptr) == MSGPACK_UNPACK_SUCCESS, "msgpack");
  }
  ~Unpacked() { msgpack_unpacked_destroy(&result_); }
  Unpacked(const Unpacked &) = delete;
  Unpacked &operator=(const Unpacked &) = delete;
  const msgpack_object &top() const { return result_.data; }

 private:
  std::string bytes_;
  msgpack_unpacked result_;
};

const msgpack_object *find(const msgpack_object &map, const std::string &key) {
  must(map.type == MSGPACK_OBJECT_MAP, "a map is expected around " + key);
  for (uint32_t i = 0; i < map.via.map.size; ++i) {
    const msgpack_object_kv &pair = map.via.map.ptr[i];
    const msgpack_object_str &name = pair.key.via.str;
    if (pair.key.type == MSGPACK_OBJECT_STR && key == std::string(name.ptr, name.size)) return &pair.val;
  }
  return nullptr;
}

const msgpack_object &at(const msgpack_object &map, const std::string &key) {
  const msgpack_object *found = find(map, key);
  must(found != nullptr, "no " + key);
  return *found;
}

double number(const msgpack_object &value) {
  if (value.type == MSGPACK_OBJECT_POSITIVE_INTEGER) return static_cast<double>(value.via.u64);
  if (value.type == MSGPACK_OBJECT_NEGATIVE_INTEGER) return static_cast<double>(value.via.i64);
  must(value.type == MSGPACK_OBJECT_FLOAT64 || value.type == MSGPACK_OBJECT_FLOAT32, "a number is expected");
  return value.via.f64;
}

double first(const msgpack_object &array) {
  must(array.type == MSGPACK_OBJECT_ARRAY && array.via.array.size > 0, "an array is expected");
  return number(array.via.array.ptr[0]);
}

std::string text(const msgpack_object &value) {
  must(value.type == MSGPACK_OBJECT_STR, "a text is expected");
  return std::string(value.via.str.ptr, value.via.str.size);
}

// -- sockets -------------------------------------------------------------------------------------------------

std::map<std::string, std::string> read_key(const char *path) {
  std::map<std::string, std::string> values;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    const size_t equals = line.find(" = \"");
    if (equals != std::string::npos) values[line.substr(0, equals)] = line.substr(equals + 4, line.size() - equals - 5);
  }
  return values;
}

struct Options {
  std::string way, where;
  std::map<std::string, std::string> key;

  std::string endpoint(const char *name, int offset) const {
    if (way == "ipc") return "ipc://" + where + "/" + name;
    const size_t colon = where.rfind(':');
    return "tcp://" + where.substr(0, colon) + ":" + std::to_string(std::stoi(where.substr(colon + 1)) + offset);
  }
};

void *opened(void *context, int kind, const Options &options, const char *name, int offset, bool newest_only) {
  void *socket = zmq_socket(context, kind);
  const int zero = 0, one = 1;
  zmq_setsockopt(socket, ZMQ_LINGER, &zero, sizeof zero);
  if (newest_only) zmq_setsockopt(socket, ZMQ_CONFLATE, &one, sizeof one);
  if (kind == ZMQ_SUB) zmq_setsockopt(socket, ZMQ_SUBSCRIBE, "rtctl/state", 11);
  if (options.way == "tcp") {
    const auto set = [&](int option, const char *part) {
      must(zmq_setsockopt(socket, option, options.key.at(part).c_str(), 41) == 0, part);
    };
    set(ZMQ_CURVE_SERVERKEY, "server_key");
    set(ZMQ_CURVE_PUBLICKEY, "public_key");
    set(ZMQ_CURVE_SECRETKEY, "secret_key");
  }
  must(zmq_connect(socket, options.endpoint(name, offset).c_str()) == 0, "connect");
  return socket;
}

bool waiting(void *socket, int wait_ms) {
  zmq_pollitem_t item = {socket, 0, ZMQ_POLLIN, 0};
  return zmq_poll(&item, 1, wait_ms) > 0;
}

std::string received(void *socket) {
  zmq_msg_t message;
  zmq_msg_init(&message);
  must(zmq_msg_recv(&message, socket, 0) >= 0, "receive");
  std::string bytes(static_cast<const char *>(zmq_msg_data(&message)), zmq_msg_size(&message));
  zmq_msg_close(&message);
  return bytes;
}

// -- the renderer --------------------------------------------------------------------------------------------

constexpr int kIdle = 1, kActive = 3;

struct Reply {
  bool ok = false;
  int64_t epoch = 0;
  std::string code, lease, role;
  double silence_s = 0, start_rad = 0, protocol = 0;
};

struct Sample {
  int state = -1;
  double position_rad = 0, sequence = -1;
  bool lease_held = false;
};

class Renderer {
 public:
  explicit Renderer(const Options &options) : context_(zmq_ctx_new()) {
    command_ = opened(context_, ZMQ_DEALER, options, "command", 0, false);
    targets_ = opened(context_, ZMQ_DEALER, options, "targets", 1, true);
    telemetry_ = opened(context_, ZMQ_SUB, options, "telemetry", 2, false);
  }
  ~Renderer() {
    for (void *socket : {command_, targets_, telemetry_}) zmq_close(socket);
    zmq_ctx_term(context_);
  }
  Renderer(const Renderer &) = delete;
  Renderer &operator=(const Renderer &) = delete;

  Reply ask(const char *op, size_t more = 0, const std::function<void(Packed &)> &fill = nullptr) {
    Packed request(2 + more);
    request.whole("id", ++id_).text("op", op);
    if (fill) fill(request);
    must(zmq_send(command_, request.data(), request.size(), 0) >= 0, "send");
    while (waiting(command_, 20000)) {
      const Unpacked message(received(command_));
      if (number(at(message.top(), "id")) == static_cast<double>(id_)) return read(message.top());
    }
    throw std::runtime_error(std::string("no reply to ") + op);
  }

  Reply granted(const char *op, size_t more = 0, const std::function<void(Packed &)> &fill = nullptr) {
    const Reply reply = ask(op, more, fill);
    must(reply.ok, std::string(op) + ": " + reply.code);
    return reply;
  }

  void send_target(double position_rad) {
    Packed target(4);
    target.text("lease", lease_.lease).whole("epoch", epoch_);
    target.numbers("position_rad", {position_rad}).numbers("velocity_rad_s", {0.0});
    zmq_send(targets_, target.data(), target.size(), ZMQ_DONTWAIT);
  }

  void listen(int wait_ms) {
    while (waiting(telemetry_, wait_ms)) {
      wait_ms = 0;
      must(received(telemetry_) == "rtctl/state", "topic");
      const Unpacked batch(received(telemetry_));
      must(batch.top().type == MSGPACK_OBJECT_ARRAY, "a batch is an array");
      for (uint32_t i = 0; i < batch.top().via.array.size; ++i) take(batch.top().via.array.ptr[i]);
    }
  }

  // Sends targets, renews the lease and listens until `condition` holds.
  void until(const std::function<bool()> &condition, const char *what, bool sending) {
    const double end = now_s() + 60;
    while (!condition()) {
      must(now_s() < end, std::string("waited too long: ") + what);
      if (sending) {
        send_target(goal_);
        if (now_s() > renewed_ + 0.25 * lease_.silence_s) {
          renewed_ = now_s();
          granted("lease", 2, [this](Packed &p) { p.whole("epoch", epoch_).text("lease", lease_.lease); });
        }
      }
      listen(5);
    }
  }

  void run() {
    const Reply hello = granted("hello");
    must(hello.protocol == 1, "protocol");
    granted("environment", 2, [](Packed &p) { p.whole("axis", 0).text("kind", "remote"); });
    until([this] { return sample_.state >= 0; }, "a sample", false);
    epoch_ = granted("status").epoch;
    lease_ = granted("lease", 1, [this](Packed &p) { p.whole("epoch", epoch_); });
    must(ask("lease", 1, [this](Packed &p) { p.whole("epoch", epoch_); }).code == "lease_taken", "two leases");
    goal_ = lease_.start_rad;
    until([this] { return sample_.lease_held; }, "the lease in the loop", true);
    double asked = 0;
    until(
        [&] {
          if (sample_.state == kActive) return true;
          if (now_s() > asked + 0.2) {
            asked = now_s();
            ask("arm", 1, [this](Packed &p) { p.whole("epoch", epoch_); });
          }
          return false;
        },
        "ACTIVE", true);
    const double before = sample_.position_rad, began = now_s();
    until(
        [&] {  // a little: a virtual object that drives the hand gives energy, which is limited
          goal_ = lease_.start_rad + 0.12 * std::min(1.0, (now_s() - began) / 0.6);
          must(sample_.state == kActive, "the rig stopped on the way");
          return sample_.position_rad > before + 0.015;
        },
        "the joint to follow", true);
    const double moved = sample_.position_rad - before;
    granted("stop");
    until([this] { return sample_.state == kIdle; }, "IDLE after the stop", false);
    const Reply old = late_target(epoch_);
    must(old.code == "wrong_epoch", "a target of before the stop was taken");
    must(late_target(old.epoch).code == "lease_lost", "the lease outlived the stop");
    std::printf("{\"role\": \"%s\", \"moved_rad\": %.6f, \"samples\": %ld, \"gaps\": %ld}\n", hello.role.c_str(), moved,
                samples_, gaps_);
  }

 private:
  Reply late_target(int64_t epoch) {
    return ask("target", 3, [&](Packed &p) {
      p.whole("epoch", epoch).text("lease", lease_.lease).numbers("position_rad", {goal_ + 0.5});
    });
  }

  static Reply read(const msgpack_object &message) {
    Reply reply;
    reply.ok = at(message, "ok").via.boolean;
    reply.epoch = static_cast<int64_t>(number(at(message, "epoch")));
    if (!reply.ok) {
      reply.code = text(at(at(message, "error"), "code"));
      return reply;
    }
    const msgpack_object &result = at(message, "result");
    if (const msgpack_object *found = find(result, "protocol")) reply.protocol = number(*found);
    if (const msgpack_object *found = find(result, "role")) reply.role = text(*found);
    if (const msgpack_object *found = find(result, "silence_s")) {
      reply.silence_s = number(*found);
      reply.lease = text(at(result, "lease"));
      reply.start_rad = first(at(result, "target_position_rad"));
    }
    return reply;
  }

  void take(const msgpack_object &map) {
    const double sequence = number(at(map, "sequence"));
    if (samples_ > 0 && sequence != sample_.sequence + 1) ++gaps_;
    sample_.sequence = sequence;
    sample_.state = static_cast<int>(number(at(map, "state")));
    sample_.position_rad = first(at(map, "position_rad"));
    sample_.lease_held = number(at(map, "lease_held")) == 1;
    ++samples_;
  }

  void *context_, *command_, *targets_, *telemetry_;
  int64_t id_ = 0, epoch_ = 0;
  Reply lease_;
  Sample sample_;
  double goal_ = 0, renewed_ = 0;
  long samples_ = 0, gaps_ = 0;
};

}  // namespace

int main(int argc, char **argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: renderer ipc DIR/RIG | renderer tcp HOST:PORT KEY\n");
    return 2;
  }
  Options options{argv[1], argv[2], {}};
  if (argc > 3) options.key = read_key(argv[3]);
  try {
    Renderer(options).run();
  } catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
