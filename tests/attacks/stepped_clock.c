/* A wall clock that somebody steps, for the processes that load this (LD_PRELOAD). Nothing of the machine's own clock is touched.
 *
 * $STEPPED_CLOCK is a file of three 64-bit numbers, mapped by all of them: by how many ns the wall clock is off now; how often it was
 * read; how often a thread began to wait for a moment of it, which a step would shorten or lengthen by as much. CLOCK_MONOTONIC is
 * left alone, as the kernel leaves it when somebody sets the time.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

static struct shared { int64_t offset_ns, reads, waits; } nobody, *shared = &nobody;

static int (*true_gettime)(clockid_t, struct timespec *);
static int (*true_nanosleep)(clockid_t, int, const struct timespec *, struct timespec *);
static int (*true_cond_wait)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *);
static int (*true_sem_wait)(sem_t *, const struct timespec *);
static int (*true_timerfd)(int, int);

/* Any moment later than this is one of the wall clock: no machine has been up for thirty years. */
enum { WALL_S = 1000000000 };

__attribute__((constructor)) static void begin(void)
{
    const char *path = getenv("STEPPED_CLOCK");
    int fd = path ? open(path, O_RDWR | O_CLOEXEC) : -1;
    if (fd < 0)
        return;
    void *made = mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    close(fd);
    if (made != MAP_FAILED)
        shared = made;
}

static void *next(const char *name)
{
    void *found = dlvsym(RTLD_NEXT, name, "GLIBC_2.3.2"); /* condition variables have an older kind by the same name */
    return found ? found : dlsym(RTLD_NEXT, name);
}
#define FIND(pointer, name) do { if (!pointer) *(void **)&pointer = next(name); } while (0)

static void count(int64_t *what) { __atomic_add_fetch(what, 1, __ATOMIC_RELAXED); }

static int is_wall(clockid_t clock) { return clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE || clock == CLOCK_TAI; }

int clock_gettime(clockid_t clock, struct timespec *out)
{
    FIND(true_gettime, "clock_gettime");
    int result = true_gettime(clock, out);
    if (result == 0 && is_wall(clock)) {
        int64_t ns = out->tv_sec * 1000000000LL + out->tv_nsec + __atomic_load_n(&shared->offset_ns, __ATOMIC_RELAXED);
        out->tv_sec = ns / 1000000000;
        out->tv_nsec = ns % 1000000000;
        count(&shared->reads);
    }
    return result;
}

int gettimeofday(struct timeval *restrict out, void *restrict zone)
{
    struct timespec now;
    (void)zone;
    clock_gettime(CLOCK_REALTIME, &now);
    out->tv_sec = now.tv_sec;
    out->tv_usec = now.tv_nsec / 1000;
    return 0;
}

time_t time(time_t *out)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (out)
        *out = now.tv_sec;
    return now.tv_sec;
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *until, struct timespec *left)
{
    FIND(true_nanosleep, "clock_nanosleep");
    if (is_wall(clock) && flags & TIMER_ABSTIME)
        count(&shared->waits);
    return true_nanosleep(clock, flags, until, left);
}

int pthread_cond_timedwait(pthread_cond_t *restrict cond, pthread_mutex_t *restrict mutex, const struct timespec *restrict until)
{
    FIND(true_cond_wait, "pthread_cond_timedwait");
    if (until->tv_sec > WALL_S)
        count(&shared->waits);
    return true_cond_wait(cond, mutex, until);
}

int sem_timedwait(sem_t *restrict semaphore, const struct timespec *restrict until)
{
    FIND(true_sem_wait, "sem_timedwait");
    count(&shared->waits);
    return true_sem_wait(semaphore, until);
}

int timerfd_create(int clock, int flags)
{
    FIND(true_timerfd, "timerfd_create");
    if (is_wall(clock))
        count(&shared->waits);
    return true_timerfd(clock, flags);
}
