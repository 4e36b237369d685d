// A ROS 2 node as rmw_fastrtps puts it on the wire, by Fast DDS alone: messages are passed through as bytes.
//
//   peer tiles DOMAIN COUNT     listens to rt/mesh as a late joiner until COUNT different tiles have come
//   peer undo DOMAIN COUNT STEP calls rq/touchup/undo COUNT times with STEP, 2 STEP, ..., and checks each answer: so often "echo"
//   peer echo DOMAIN COUNT      sends COUNT wrenches at 1 kHz, and times the mismatches that come back
//
// Prints "ok" with what it measured, or what is wrong; ends with 0 or 1.

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using eprosima::fastrtps::rtps::WriteParams;
using Clock = std::chrono::steady_clock;

// a message as it is on the wire, four bytes of encapsulation first
using Bytes = std::vector<uint8_t>;

struct Raw : TopicDataType {
  explicit Raw(const char* name) {
    setName(name);
    m_typeSize = 4 << 20;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<Bytes*>(data);
    payload->encapsulation = CDR_LE;
    payload->length = bytes.size();
    std::memcpy(payload->data, bytes.data(), bytes.size());
    return true;
  }
  bool deserialize(SerializedPayload_t* payload, void* data) override {
    static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<uint32_t>(static_cast<Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

// reads CDR, little endian
struct Cdr {
  const Bytes& bytes;
  size_t at = 4;
  template <class T> T number() {
    at = 4 + (at - 4 + sizeof(T) - 1) / sizeof(T) * sizeof(T);
    T value{};
    if (at + sizeof(T) <= bytes.size()) std::memcpy(&value, &bytes[at], sizeof(T));
    at += sizeof(T);
    return value;
  }
  std::string text() {
    auto length = number<uint32_t>();
    if (length == 0 || at + length > bytes.size()) return {};
    std::string value(reinterpret_cast<const char*>(&bytes[at]), length - 1);
    at += length;
    return value;
  }
};

struct Listener : DataReaderListener {
  std::mutex mutex;
  std::condition_variable more;
  std::vector<std::pair<Bytes, SampleInfo>> got;
  void on_data_available(DataReader* reader) override {
    Bytes bytes;
    SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      std::lock_guard<std::mutex> lock(mutex);
      got.emplace_back(bytes, info);
      more.notify_one();
    }
  }
  bool next(Bytes& bytes, SampleInfo& info, std::chrono::milliseconds patience) {
    std::unique_lock<std::mutex> lock(mutex);
    if (!more.wait_for(lock, patience, [&] { return !got.empty(); })) return false;
    bytes = got.front().first;
    info = got.front().second;
    got.erase(got.begin());
    return true;
  }
};

struct Node {
  DomainParticipant* participant;
  explicit Node(int domain) {
    participant = DomainParticipantFactory::get_instance()->create_participant(domain, PARTICIPANT_QOS_DEFAULT);
  }
  Topic* topic(const char* name, const char* type_name) {
    TypeSupport type(new Raw(type_name));
    type.register_type(participant);
    return participant->create_topic(name, type_name, TOPIC_QOS_DEFAULT);
  }
  DataReader* reader(const char* name, const char* type_name, bool latched, DataReaderListener& listener,
                     bool reliable = true) {
    DataReaderQos qos = DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind = latched ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
    qos.history().kind = KEEP_LAST_HISTORY_QOS;
    qos.history().depth = latched ? 4096 : 10;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    auto* subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
    return subscriber->create_datareader(topic(name, type_name), qos, &listener);
  }
  DataWriter* writer(const char* name, const char* type_name, bool reliable = true) {
    DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    auto* publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
    return publisher->create_datawriter(topic(name, type_name), qos);
  }
};

int tiles(int domain, size_t count) {
  Listener listener;
  Node node(domain);
  node.reader("rt/mesh", "visualization_msgs::msg::dds_::Marker_", true, listener);
  const auto begin = Clock::now();
  std::set<int32_t> ids;
  size_t length = 0;
  Bytes bytes;
  SampleInfo info;
  while (ids.size() < count) {
    if (!listener.next(bytes, info, std::chrono::seconds(20))) {
      std::printf("only %zu of %zu tiles came\n", ids.size(), count);
      return 1;
    }
    Cdr cdr{bytes};
    cdr.number<int32_t>();
    cdr.number<uint32_t>();
    cdr.text();
    if (cdr.text() != "mesh") {
      std::printf("a tile has another namespace\n");
      return 1;
    }
    ids.insert(cdr.number<int32_t>());
    length += bytes.size();
  }
  const std::chrono::duration<double> took = Clock::now() - begin;
  std::printf("ok %zu tiles %zu bytes %.3f s\n", ids.size(), length, took.count());
  return 0;
}

int undo(int domain, uint32_t count, uint32_t step) {
  Listener listener;
  Node node(domain);
  auto* reader = node.reader("rr/touchup/undoReply", "touchup_msgs::srv::dds_::Undo_Response_", false, listener);
  auto* writer = node.writer("rq/touchup/undoRequest", "touchup_msgs::srv::dds_::Undo_Request_");
  std::vector<double> times;
  for (uint32_t strokes = step; strokes <= count * step; strokes += step) {
    std::string expected;
    for (uint32_t i = 0; i < strokes; ++i) expected += "echo";
    const auto until = Clock::now() + std::chrono::seconds(20);
    bool answered = false;
    while (!answered && Clock::now() < until) {
      Bytes request = {0, 1, 0, 0, 0, 0, 0, 0};
      std::memcpy(&request[4], &strokes, 4);
      WriteParams params;
      // as rmw_fastrtps: the answer is for this reader
      params.related_sample_identity().writer_guid(reader->guid());
      const auto begin = Clock::now();
      writer->write(&request, params);
      const auto wanted = params.sample_identity().sequence_number();
      Bytes bytes;
      SampleInfo info;
      // before both sides know each other an answer may be lost: ask again
      while (!answered && listener.next(bytes, info, std::chrono::milliseconds(500))) {
        if (info.related_sample_identity.sequence_number() != wanted) continue;
        Cdr cdr{bytes};
        const bool success = cdr.number<uint8_t>();
        const bool is_right = success && cdr.text() == expected && cdr.number<uint32_t>() == strokes &&
                              cdr.number<uint64_t>() == uint64_t(1) << 40;
        if (!is_right || info.related_sample_identity.writer_guid() != reader->guid()) {
          std::printf("call %u has a wrong answer\n", strokes);
          return 1;
        }
        times.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
        answered = true;
      }
    }
    if (!answered) {
      std::printf("call %u has no answer\n", strokes);
      return 1;
    }
  }
  std::sort(times.begin(), times.end());
  std::printf("ok %u calls p50 %.0f us max %.0f us\n", count, times[times.size() / 2], times.back());
  return 0;
}

// when each of the messages came back
struct Times : DataReaderListener {
  std::vector<Clock::time_point> came;
  explicit Times(size_t count) : came(count) {}
  void on_data_available(DataReader* reader) override {
    Bytes bytes;
    SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      Cdr cdr{bytes};
      const auto number = cdr.number<uint32_t>();
      if (number < came.size()) came[number] = Clock::now();
    }
  }
};

int echo(int domain, uint32_t count) {
  Times times(count);
  Node node(domain);
  node.reader("rt/mismatch", "touchup_msgs::msg::dds_::HapticMismatch_", false, times, false);
  auto* writer = node.writer("rt/stylus/wrench", "geometry_msgs::msg::dds_::WrenchStamped_", false);
  std::this_thread::sleep_for(std::chrono::seconds(3));
  std::vector<Clock::time_point> sent(count);
  auto next = Clock::now();
  for (uint32_t number = 0; number < count; ++number) {
    Bytes wrench(4 + 16 + 48, 0);
    wrench[1] = 1;
    std::memcpy(&wrench[4], &number, 4);
    wrench[12] = 2;
    wrench[16] = 's';
    sent[number] = Clock::now();
    writer->write(&wrench);
    next += std::chrono::milliseconds(1);
    std::this_thread::sleep_until(next);
  }
  std::this_thread::sleep_for(std::chrono::seconds(1));
  std::vector<double> took;
  for (uint32_t number = 0; number < count; ++number)
    if (times.came[number] != Clock::time_point{})
      took.push_back(std::chrono::duration<double, std::micro>(times.came[number] - sent[number]).count());
  std::sort(took.begin(), took.end());
  if (took.size() < count) {
    std::printf("only %zu of %u came back\n", took.size(), count);
    return 1;
  }
  const auto at = [&](double share) { return took[size_t(share * (took.size() - 1))]; };
  std::printf("ok %u echoes p50 %.0f us p99 %.0f us max %.0f us\n", count, at(0.5), at(0.99), at(1));
  return 0;
}

int main(int argc, char** argv) {
  if (argc == 4 && std::string(argv[1]) == "tiles") return tiles(std::stoi(argv[2]), std::stoul(argv[3]));
  if (argc == 5 && std::string(argv[1]) == "undo") {
    return undo(std::stoi(argv[2]), std::stoul(argv[3]), std::stoul(argv[4]));
  }
  if (argc == 4 && std::string(argv[1]) == "echo") return echo(std::stoi(argv[2]), std::stoul(argv[3]));
  std::printf("usage: peer tiles|undo|echo DOMAIN COUNT [STEP]\n");
  return 1;
}
