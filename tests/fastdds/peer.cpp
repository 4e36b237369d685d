// A ROS 2 node as rmw_fastrtps puts it on the wire, by Fast DDS alone: it passes messages through as bytes.
//
//   peer tiles DOMAIN COUNT          listens to rt/mesh as a late joiner until COUNT different tiles have come
//   peer echo DOMAIN COUNT           sends COUNT wrenches, up to 32 ahead of the mismatches that come back, and times those
//   peer listen DOMAIN TOPIC TYPE    listens; writes each message as a line "message HEXADECIMAL"
//   peer call DOMAIN SERVICE TYPE    sends each line of standard input, hexadecimal, as a request; "answer HEXADECIMAL" comes back
//
// Writes "matched" once its readers and writers have met those of others; echo and call go on with the next line of standard input,
// as the others may know nothing of it yet. Ends with 0, listen and call at the end of standard input; with 1 after an error message.

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
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

// a busy machine may take its time with arrivals; tests wait for 120 s
constexpr std::chrono::seconds PATIENCE{100};

// a message on the wire, four bytes of encapsulation first
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

// number of matched endpoints of others
struct Met {
  std::mutex mutex;
  std::condition_variable more;
  int count = 0;
  void add(int change) {
    std::lock_guard<std::mutex> lock(mutex);
    count += change;
    more.notify_all();
  }
  bool all(int wanted) {
    std::unique_lock<std::mutex> lock(mutex);
    if (!more.wait_for(lock, PATIENCE, [&] { return count >= wanted; })) {
      std::printf("no other participant was discovered\n");
      return false;
    }
    std::printf("matched\n");
    std::fflush(stdout);
    return true;
  }
};
Met met;

struct WriterListener : DataWriterListener {
  void on_publication_matched(DataWriter*, const PublicationMatchedStatus& status) override { met.add(status.current_count_change); }
};
WriterListener writer_listener;

struct ReaderListener : DataReaderListener {
  void on_subscription_matched(DataReader*, const SubscriptionMatchedStatus& status) override { met.add(status.current_count_change); }
};

struct Listener : ReaderListener {
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
    return publisher->create_datawriter(topic(name, type_name), qos, &writer_listener);
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
    if (!listener.next(bytes, info, PATIENCE)) {
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

Bytes from_hexadecimal(const std::string& digits) {
  Bytes bytes;
  for (size_t i = 0; i + 1 < digits.size(); i += 2) bytes.push_back(std::stoul(digits.substr(i, 2), nullptr, 16));
  return bytes;
}

void write(const char* what, const Bytes& bytes) {
  std::printf("%s ", what);
  for (const auto byte : bytes) std::printf("%02x", byte);
  std::printf("\n");
  std::fflush(stdout);
}

int call(int domain, const std::string& service, const std::string& type) {
  Listener listener;
  Node node(domain);
  const auto answers = "rr" + service + "Reply", requests = "rq" + service + "Request";
  auto* reader = node.reader(answers.c_str(), (type + "_Response_").c_str(), false, listener);
  auto* writer = node.writer(requests.c_str(), (type + "_Request_").c_str());
  if (!met.all(2)) return 1;
  for (std::string line; std::getline(std::cin, line);) {
    Bytes request = from_hexadecimal(line);
    WriteParams params;
    // as rmw_fastrtps: the answer is for this reader
    params.related_sample_identity().writer_guid(reader->guid());
    writer->write(&request, params);
    const auto wanted = params.sample_identity().sequence_number();
    Bytes bytes;
    SampleInfo info;
    if (!listener.next(bytes, info, PATIENCE)) {
      std::printf("no answer\n");
      return 1;
    }
    const auto& named = info.related_sample_identity;
    if (named.sequence_number() != wanted || named.writer_guid() != reader->guid()) {
      std::printf("the answer names another request\n");
      return 1;
    }
    write("answer", bytes);
  }
  return 0;
}

int listen(int domain, const char* topic, const char* type) {
  Listener listener;
  Node node(domain);
  node.reader(topic, type, false, listener);
  if (!met.all(1)) return 1;
  std::thread writing([&] {
    Bytes bytes;
    SampleInfo info;
    while (listener.next(bytes, info, std::chrono::hours(1))) write("message", bytes);
  });
  writing.detach();
  for (std::string line; std::getline(std::cin, line);) {
  }
  std::quick_exit(0);
}

// time of the return of each message
struct Times : ReaderListener {
  std::mutex mutex;
  std::condition_variable more;
  std::vector<Clock::time_point> came;
  size_t count = 0;
  bool in_order = true;
  explicit Times(size_t count) : came(count) {}
  void on_data_available(DataReader* reader) override {
    Bytes bytes;
    SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      Cdr cdr{bytes};
      const auto number = cdr.number<uint32_t>();
      std::lock_guard<std::mutex> lock(mutex);
      in_order = in_order && number == count;
      if (number < came.size()) came[number] = Clock::now();
      ++count;
      more.notify_one();
    }
  }
};

int echo(int domain, uint32_t count) {
  Times times(count);
  Node node(domain);
  node.reader("rt/mismatch", "touchup_msgs::msg::dds_::HapticMismatch_", false, times, false);
  auto* writer = node.writer("rt/stylus/wrench", "geometry_msgs::msg::dds_::WrenchStamped_", false);
  std::string line;
  if (!met.all(2) || !std::getline(std::cin, line)) return 1;
  std::vector<Clock::time_point> sent(count);
  const auto until_behind = [&](size_t wanted) {
    std::unique_lock<std::mutex> lock(times.mutex);
    return times.more.wait_for(lock, PATIENCE, [&] { return times.count >= wanted || !times.in_order; });
  };
  constexpr uint32_t AHEAD = 32;
  for (uint32_t number = 0; number < count; ++number) {
    Bytes wrench(4 + 16 + 48, 0);
    wrench[1] = 1;
    std::memcpy(&wrench[4], &number, 4);
    wrench[12] = 2;
    wrench[16] = 's';
    if (number >= AHEAD && !until_behind(number - AHEAD + 1)) break;
    sent[number] = Clock::now();
    writer->write(&wrench);
  }
  until_behind(count);
  if (!times.in_order) {
    std::printf("wrench %zu or the one before it did not come back in its turn\n", times.count);
    return 1;
  }
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
  const std::string what = argc > 1 ? argv[1] : "";
  if (argc == 4 && what == "tiles") return tiles(std::stoi(argv[2]), std::stoul(argv[3]));
  if (argc == 4 && what == "echo") return echo(std::stoi(argv[2]), std::stoul(argv[3]));
  if (argc == 5 && what == "call") return call(std::stoi(argv[2]), argv[3], argv[4]);
  if (argc == 5 && what == "listen") return listen(std::stoi(argv[2]), argv[3], argv[4]);
  std::printf("usage: peer tiles|echo|call|listen DOMAIN ...\n");
  return 1;
}
