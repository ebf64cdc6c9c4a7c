/* The broadcast ring of shm/broadcast_ring.h: one writer that may die before any of its stores and is started again,
 * readers that it laps. Memory is weaker than one store at a time: a store waits in a buffer and may become visible
 * before earlier ones, except across a fence, at one location, or as a release store after what came before it
 * (multi-copy atomic, as arm64 and x86 are). A dead writer's stores still come out; its successor holds the lock file
 * and therefore sees them. Loads happen when they are made: the acquire order the reader asks for leaves only the
 * payload's words free, and these are read in either order.
 *
 * Checked: what a reader accepts is whole and is the message it asked for, also when it goes back over the history
 * (RingReader::rewind) before or after a death; what it passes over was overwritten; at every death and at the end all
 * messages that lie under no slot just begun are complete. Each BROKEN_ variant leaves one step out and must be found
 * wanting (tests/models/check_models.sh). The bell is tests/models/bell.pml. */
#ifndef SLOTS
#define SLOTS 3
#endif
#ifndef MESSAGES
#define MESSAGES 5
#endif
#ifndef DEATHS
#define DEATHS 2
#endif
#ifndef READERS
#define READERS 1
#endif
#ifndef REWINDS
#define REWINDS 0   /* of each reader */
#endif
#define BUFFER 6

#define PUBLISHED 0
#define SEQ(n) (1 + ((n) - 1) % SLOTS)
#define WORD(n, k) (1 + SLOTS + 2 * (((n) - 1) % SLOTS) + (k))
#define LOCATIONS (1 + 3 * SLOTS)

byte memory[LOCATIONS];
byte where[BUFFER], what[BUFFER], epoch_of[BUFFER];
bit release[BUFFER];
byte waiting = 0, epoch = 0;

/* Entry i may become visible: nothing before it is at its place or behind a fence, and nothing at all if it releases. */
inline may_commit(i) {
  ok = 1; j = 0;
  do
  :: j < i ->
     if
     :: where[j] == where[i] || epoch_of[j] < epoch_of[i] || release[i] -> ok = 0
     :: else
     fi;
     j++
  :: else -> break
  od
}

active proctype Memory() {
  byte i, j;
  bit ok;
end:
  do
  :: atomic {
       waiting > 0 -> i = 0;
       do
       :: i < waiting - 1 -> i++   /* any of them */
       :: break
       od;
       may_commit(i);
       if
       :: ok ->
          memory[where[i]] = what[i];
          do
          :: i < waiting - 1 ->
             where[i] = where[i + 1]; what[i] = what[i + 1]; epoch_of[i] = epoch_of[i + 1]; release[i] = release[i + 1];
             i++
          :: else -> break
          od;
          waiting--;
          where[waiting] = 0; what[waiting] = 0; epoch_of[waiting] = 0; release[waiting] = 0;
          if
          :: waiting == 0 -> epoch = 0   /* nothing left to order: keeps the numbers small */
          :: else
          fi
       :: else
       fi;
       i = 0; j = 0; ok = 0
     }
  od
}

/* One store of the writer; it may die instead. */
#define STORE(location, value, is_release)                                             \
  if                                                                                    \
  :: atomic { waiting < BUFFER ->                                                       \
       where[waiting] = (location); what[waiting] = (value);                            \
       epoch_of[waiting] = epoch; release[waiting] = (is_release); waiting++ }          \
  :: atomic { deaths < DEATHS -> deaths++; goto dead }                                  \
  fi
#define FENCE epoch++

/* The newest SLOTS - 1 messages. */
#define WHOLE(n) (memory[SEQ(n)] == 2 * (n) && memory[WORD(n, 0)] == memory[WORD(n, 1)] && memory[WORD(n, 0)] / 4 == (n))
inline history_is_whole() {
  n = memory[PUBLISHED];
  do
  :: n > 0 && n + SLOTS - 1 > memory[PUBLISHED] -> assert(WHOLE(n)); n--
  :: else -> break
  od;
  n = 0
}

active proctype Writer() {
  byte n, life = 0, deaths = 0;
start:
#ifdef BROKEN_FORGETFUL_SUCCESSOR
  n = 1;
#else
  n = memory[PUBLISHED] + 1;
#endif
  do
  :: n <= MESSAGES ->
#ifndef BROKEN_NO_MARK
     STORE(SEQ(n), 2 * n - 1, 0);
#endif
#ifndef BROKEN_NO_FENCE
     FENCE;
#endif
     STORE(WORD(n, 0), 4 * n + life, 0);
     STORE(WORD(n, 1), 4 * n + life, 0);
#ifdef BROKEN_PUBLISHED_FIRST
     STORE(PUBLISHED, n, 1);
     STORE(SEQ(n), 2 * n, 1);
#else
     STORE(SEQ(n), 2 * n, 1);
#ifdef BROKEN_RELAXED_PUBLISH
     STORE(PUBLISHED, n, 0);
#else
     STORE(PUBLISHED, n, 1);
#endif
#endif
     n++
  :: else -> break
  od;
  atomic { waiting == 0 -> history_is_whole() };
  goto done;
dead:
  atomic { waiting == 0 -> history_is_whole(); life++; goto start };
done:
  skip
}

/* RingReader::next, then use of the words, then RingReader::intact. */
active [READERS] proctype Reader() {
  byte seen = 0, newest, n, first, second;
#if REWINDS > 0
  byte rewinds = 0;
#endif
end:
  do
#if REWINDS > 0
  :: atomic { rewinds < REWINDS && seen > 0 -> rewinds++; newest = memory[PUBLISHED];
       if
       :: newest >= SLOTS -> seen = newest - SLOTS + 1
       :: else -> seen = 0
       fi;
       newest = 0 }
#endif
  :: atomic { memory[PUBLISHED] > seen -> newest = memory[PUBLISHED] };
     n = seen + 1;
     if
     :: newest - n >= SLOTS - 1 -> n = newest - SLOTS + 2
     :: else
     fi;
     seen = n;
     if
     :: atomic { memory[SEQ(n)] == 2 * n -> skip };
        if
        :: first = memory[WORD(n, 0)]; second = memory[WORD(n, 1)]
        :: second = memory[WORD(n, 1)]; first = memory[WORD(n, 0)]
        fi;
#ifdef BROKEN_NO_RECHECK
        assert(first == second && first / 4 == n)
#else
        if
        :: atomic { memory[SEQ(n)] == 2 * n -> assert(first == second && first / 4 == n) }
        :: atomic { memory[SEQ(n)] != 2 * n -> skip }
        fi
#endif
     :: atomic { memory[SEQ(n)] != 2 * n -> assert(memory[SEQ(n)] > 2 * n) }   /* lapped, not merely late */
     fi;
     first = 0; second = 0; n = 0; newest = 0
  od
}
