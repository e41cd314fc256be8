/*
 * Moves the wall clock of a process: LD_PRELOAD=stepped_clock.so STEPPED_CLOCK=FILE.
 *
 * FILE holds the offset in ns, 8 bytes, and may change at any time. The steady clock stays as it is,
 * as it does where an administrator or NTP sets the time. Who waits on a condition until an instant of
 * the wall clock waits as long as that clock tells when the wait begins.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

static const int64_t SECOND = 1000000000;
static const int64_t none = 0;
static const volatile int64_t *offset = &none;
static int (*told_by_system)(clockid_t, struct timespec *);
static int (*waited_by_system)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *);

__attribute__((constructor)) static void begin(void) {
  const char *name = getenv("STEPPED_CLOCK");
  int file = name ? open(name, O_RDONLY | O_CLOEXEC) : -1;
  told_by_system = dlsym(RTLD_NEXT, "clock_gettime");
  /* without its version, the one for programs of before 2003 is found on x86 */
  waited_by_system = dlvsym(RTLD_NEXT, "pthread_cond_timedwait", "GLIBC_2.3.2");
  if (!waited_by_system) waited_by_system = dlsym(RTLD_NEXT, "pthread_cond_timedwait");
  if (file < 0) return;
  void *page = mmap(NULL, sizeof none, PROT_READ, MAP_SHARED, file, 0);
  if (page != MAP_FAILED) offset = page;
  close(file);
}

int clock_gettime(clockid_t clock, struct timespec *told) {
  if (!told_by_system) begin(); /* a library that is loaded before asks as well */
  int status = told_by_system(clock, told);
  if (status == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) {
    int64_t now = told->tv_sec * SECOND + told->tv_nsec + *offset;
    told->tv_sec = now / SECOND;
    told->tv_nsec = now % SECOND;
  }
  return status;
}

int gettimeofday(struct timeval *told, void *zone) {
  struct timespec now;
  (void)zone;
  int status = clock_gettime(CLOCK_REALTIME, &now);
  told->tv_sec = now.tv_sec;
  told->tv_usec = now.tv_nsec / 1000;
  return status;
}

time_t time(time_t *told) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  if (told) *told = now.tv_sec;
  return now.tv_sec;
}

int pthread_cond_timedwait(pthread_cond_t *condition, pthread_mutex_t *mutex,
                           const struct timespec *until) {
  struct timespec real = *until;
  if (!waited_by_system) begin();
  if (until->tv_sec > 500000000) { /* else it is of the steady clock, which began with the machine */
    int64_t instant = until->tv_sec * SECOND + until->tv_nsec - *offset;
    real.tv_sec = instant / SECOND;
    real.tv_nsec = instant % SECOND;
  }
  return waited_by_system(condition, mutex, &real);
}
