var E=class extends Error{constructor(e,t){super(t),this.code=e}};var ee=(n,e)=>Object.assign(e,Reflect.get(globalThis,"ptmWords")?.[n]);var S=ee("objects",{relief:"The relief of {name} does not fit the index.",object:"an object",octree:"The index has a wrong octree: {reason}",largeTexture:"This graphics card has no textures of 4,096 texels.",largeImage:"The image is larger than this graphics card's textures.",damaged:"{file} is damaged: {reason}",noSets:"This site has no interlaced images, so you see its own textures.",fixed:"The policy and the comparison are those of other textures than interlaced images."});var se=Promise.resolve();var R=(n,e)=>n.replace(/\{(\w+)\}/g,(t,s)=>e[s]);var k=()=>performance.now()/1e3;function U(n,{program:e,at:t},s){n.useProgram(e),n.uniform3fv(t.eye,s.eye),n.uniformMatrix3fv(t.turn,!1,s.turn),n.uniform4fv(t.lens,s.lens)}var I=(n="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${n}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,P=`
uniform sampler2D map;
uniform int channels;
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel(){
vec4 sampled=texture(map,uv);
if(channels==1)sampled=vec4(sampled.rrr,1.0);
if(channels==2)sampled=sampled.rrrg;
return channels==0?vec4(mean,1.0):sampled;
}`,oe=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
uniform float cutoff;
out vec4 shown;
${P}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
float glow=0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,H=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,re=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${H}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,ne=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${H}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,Le=[I(),oe],Pe=[I(),re],_e=[I(),ne];function O(n,e,t,s=0,o=s){let r=0;for(let i=0;i<3;i++){let l=Math.max(e[s+i]-n[i],n[i]-t[o+i],0);r+=l*l}return Math.sqrt(r)}var ie=[.5,.7,.6].map(n=>n/Math.hypot(.5,.7,.6)),G=`
float lit(vec3 normal){
float along=(1.0+dot(normal,vec3(${ie.join()})))/2.0;
return ${.3}+${1-.3}*along*along;
}`;var ae=Uint32Array.from({length:256},(n,e)=>{for(let t=0;t<8;t++)e=e&1?e>>>1^3988292384:e>>>1;return e});function $(n,e=0){let t=~e;for(let s=0;s<n.length;s++)t=ae[(t^n[s])&255]^t>>>8;return~t>>>0}var g=4096,B=2**24,ce=7,le=65536,he=new Uint8Array([3,0]),z=2,fe=4;function y(n,e){if(!n)throw new Error(e)}var _=(n,e,t)=>Number.isInteger(n)&&e<=n&&n<=t;function j({cube:n,levels:e,streams:t}){let s=o=>typeof o=="number"&&Math.abs(o)<=1e15;y(Array.isArray(n?.low)&&n.low.length===3&&n.low.every(s),"no cube"),y(s(n.side)&&n.side>=1e-15,"no cube"),y(Array.isArray(e)&&_(e.length,1,21),"no levels"),y(e.every(o=>_(o,1,B)),"a level without texels"),y(e.reduce((o,r)=>o+r,0)<=B,"too many texels");for(let o of t){for(let r of[o?.ends,o?.crc32])y(Array.isArray(r)&&r.length===e.length,"lists of other lengths"),y(r.every(i=>_(i,0,4294967295)),"a list without numbers");y(o.ends.every((r,i)=>r>(i?o.ends[i-1]:z)),"ends that do not ascend")}}var de=64,ue=10,F=(n,e)=>n?n+1:Math.min(ce,e),V=n=>typeof n?.code=="string"&&n.code.startsWith("PTM-V"),C=class{rows=0;constructor(e,t){this.gl=e;let s=Math.max(1,Math.ceil(t/g));this.size=4*g*s,this.bytes=new Uint8Array(this.size),this.texture=e.createTexture(),this.#e(()=>{e.texStorage2D(e.TEXTURE_2D,1,e.RGBA8UI,g,s);for(let o of[e.TEXTURE_MIN_FILTER,e.TEXTURE_MAG_FILTER])e.texParameteri(e.TEXTURE_2D,o,e.NEAREST)})}#e(e){let{gl:t}=this;t.activeTexture(t.TEXTURE3),t.bindTexture(t.TEXTURE_2D,this.texture),e(),t.activeTexture(t.TEXTURE0)}upload(e){let{gl:t,bytes:s,rows:o}=this;if(!s)return!0;let r=Math.ceil(e/g),i=Math.min(r,o+de);return this.#e(()=>t.texSubImage2D(t.TEXTURE_2D,0,0,o,g,i-o,t.RGBA_INTEGER,t.UNSIGNED_BYTE,s,4*g*o)),this.rows=Math.min(i,Math.floor(e/g)),i===r}},D=class{#e=[0,0];#t=0;#s=!1;#o=[];constructor(e,t,s,o,r){this.gl=e,this.index=t,this.urlOf=s,this.fetcher=o,this.step=r,this.starts=[0];for(let i of t.levels)this.starts.push((this.starts.at(-1)??0)+i);if(this.count=this.starts.at(-1),e.getParameter(e.MAX_TEXTURE_SIZE)<g)throw new E("PTM-V101",S.largeTexture);this.streams=t.streams,this.texels=this.streams.map(()=>new C(e,this.count)),this.levels=0,this.partial=!1,this.updates=0,this.running=!1,this.restsUntil=0,this.progress=void 0}get complete(){return this.levels===this.index.levels.length}delete(){this.#s=!0;for(let{texture:e}of this.texels)this.gl.deleteTexture(e)}get bytes(){return this.texels.reduce((e,{size:t})=>e+t,0)}get rests(){return k()<this.restsUntil}get fetched(){return this.levels?this.streams.reduce((e,{ends:t})=>e+t[this.levels-1],0):0}advance(e,t,s,o=F(this.levels,this.index.levels.length)){if(!(this.running||this.complete||this.rests||!e(this.levels)))return this.running=!0,this.#n(o).then(()=>s?.(),r=>{this.restsUntil=r.code==="PTM-V104"?k()+ue:1/0,this.#s||t(r)}).finally(()=>this.running=!1)}async#n(e){let t=this.step&&this.levels?setInterval(()=>this.#i(),1e3*this.step):0;try{await Promise.all(this.streams.map((s,o)=>this.#a(o,this.levels,e)))}finally{clearInterval(t),this.partial=!1}for(let s of this.texels)for(;!this.#s&&!s.upload(this.starts[e]);)await new Promise(o=>setTimeout(o,16));if(!this.#s&&(this.updates++,this.levels=e,this.complete))for(let s of this.texels)s.bytes=null}#i(){let e=Math.min(...this.#e.slice(0,this.streams.length));if(!(this.#s||e<=Math.max(this.#t,this.starts[this.levels]))){for(let t of this.texels)for(;!t.upload(e););this.#t=e,this.updates++,this.partial=!0}}async#a(e,t,s){try{await this.#r(e,t,s,"default")}catch(o){if(V(o))throw o;this.#o[e]=null,await this.#r(e,t,s,"no-store").catch(r=>{throw V(r)?r:new E("PTM-V105",R(S.damaged,{file:this.streams[e].file,reason:r.message}))})}}async#r(e,t,s,o){let r=this.streams[e],i=this.texels[e],l=i.bytes,h=t?r.ends[t-1]:z,a=r.ends[s-1]-(s===r.ends.length?fe:0),c=new DecompressionStream("deflate-raw"),f=c.writable.getWriter(),u=4*this.starts[s],m=new Map,d=4*this.starts[t],x=t;i.rows=Math.min(i.rows,Math.floor(this.starts[t]/g)),this.#e[e]=this.#t=this.starts[t];let p=(async()=>{for(let w=c.readable.getReader();;){let{done:M,value:T}=await w.read();if(M)return;y(d+T.length<=u,"more texels than the index says"),l.set(T,d);for(let b=0;b<T.length;){let A=4*this.starts[x+1]-d,N=T.subarray(b,b+A);m.set(x,$(N,m.get(x))),b+=N.length,d+=N.length,N.length===A&&x++}this.#e[e]=Math.floor(d/4)}})();p.catch(()=>{});let v=this.step&&t?le:a-h;for(let w=h;w<a;w+=v){let M=await this.#c(e,w,Math.min(w+v,a),o);await Promise.race([f.write(M),p])}s<r.ends.length&&await Promise.race([f.write(he),p]),await Promise.all([f.close(),p]),y(d===u,"fewer texels than the index says");for(let w=t;w<s;w++)y(m.get(w)===r.crc32[w],`level ${w} has another checksum`)}async#c(e,t,s,o){let{file:r,ends:i}=this.streams[e],l=i.at(-1),h=this.#o[e];if(!h){let a=await this.fetcher.range(this.urlOf(r),t,s,l,this.progress,o);if(a.begin===t&&a.body.length===s-t)return a.body;h=this.#o[e]=a.body}return h.subarray(t,s)}};var W=`
uniform usampler2D octree;
uniform int texels,deepest;
uniform bool partial;
uvec4 texel(usampler2D of,int address){
return texelFetch(of,ivec2(address % ${g},address/${g}),0);
}
int ones(uint mask){
mask-=mask >> 1u & 0x55u;
mask=(mask & 0x33u)+(mask >> 2u & 0x33u);
return int((mask+(mask >> 4u))& 0x0fu);
}
int addressAt(vec3 at,int stop){
at=clamp(at,0.0,0.99999994);
int address=0;
uvec4 here=texel(octree,0);
stop=min(stop,deepest+int(partial));
for(int depth=0; here.a !=0u && depth < stop && address+1 < texels; depth++){
at*=2.0;
bvec3 upper=greaterThanEqual(at,vec3(1.0));
at-=vec3(upper);
uint bit=1u <<(uint(upper.x)+2u*uint(upper.y)+4u*uint(upper.z));
if((here.a & bit)==0u)break;
uvec4 below=texel(octree,address+1);
int next=int(below.r | below.g << 8u | below.b << 16u);
next+=ones(here.a &(bit-1u))+ones(below.a &(bit-1u));
if(next >=texels)break;
uvec4 there=texel(octree,next);
if(partial && depth==deepest && there.rgb==uvec3(0u))break;
address=next;
here=there;
}
return address;
}
int stopDepth(vec3 at){
vec3 dx=dFdx(at),dy=dFdy(at);
return-((floatBitsToInt(min(dot(dx,dx),dot(dy,dy)))>> 23)-127 >> 1);
}`;var X=128<<20,me=.1,pe=I(`
uniform vec3 low;
uniform float side;
out vec3 q;`,"q = (position - low) / side;"),we=`#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec3 q;
uniform float cutoff;
out vec4 shown;
${P}
${W}
${G}
void main(){
int stop=stopDepth(q);
vec4 sampled=textured?texel():vec4(1.0);
vec3 normal=normalize(vec3(texel(octree,addressAt(q,stop)).rgb)/127.5-1.0);
shown=vec4(sampled.rgb*color.rgb*painted*lit(normal),sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
shown.a=1.0;
}`,L=class{#e=[];#t=new Map;#s=new Map;competes=()=>!1;#o=!1;#n=[];constructor(e,t,s,o,r,i,l){this.gl=e,this.site=s,this.fetcher=o,this.report=r,this.touch=i,this.indices=t.map(h=>{try{let{cube:a,levels:c,file:f,ends:u,crc32:m}=h,d={cube:a,levels:c,streams:[{file:f,ends:u,crc32:m}]};return j(d),d}catch(a){return r(new E("PTM-V105",R(S.octree,{reason:a.message}))),null}}),this.program=l.compile("octree",[pe,we])}delete(){for(let e of this.#e)e?.delete();this.#e=[]}has({octree:e}){return(this.#e[e]?.levels??0)>0}get lacks(){return!this.#o||[...this.#t.keys()].some(e=>this.#a(e))}get levels(){return Array.from(this.#e,e=>e?.levels??0)}get bytes(){return this.#e.reduce((e,t)=>e+(t?.bytes??0),0)}advance(e,t,s,o){this.#t.clear(),this.#s.clear(),this.#o=!0;let r=k(),i=this.gl.drawingBufferWidth*this.gl.drawingBufferHeight;for(let{batches:a}of e)for(let{look:{octree:c,blends:f},low:u,high:m}of a){let d=this.indices[c];if(!d||f)continue;let x=Math.max(me,O(t,u,m)),p=s/2/x,v=p*d.cube.side;this.#t.set(c,Math.max(v,this.#t.get(c)??0));let[w,M,T]=[0,1,2].map(A=>m[A]-u[A]),b=Math.min(1,p*p*M*Math.max(w,T)/i);this.#s.set(c,Math.max(b,this.#s.get(c)??0)),this.#n[c]=r}if(!o||this.competes()||this.#e.some(a=>a?.running))return;let l=-1,h=0;for(let a of this.#t.keys()){let c=this.#i(a);c>h&&this.#a(a)&&([l,h]=[a,c])}l>=0&&this.load(l)}get wanted(){return[...this.#t].filter(([t])=>this.#a(t)&&!this.#e[t]?.running).map(([t,s])=>{let o=this.#e[t]?.levels??0,r=this.indices[t]?.levels.length??0;return{number:t,levels:o,following:F(o,r),share:this.#s.get(t)??0,finest:Math.min(r,1+Math.ceil(Math.log2(s)))}})}#i(e){let t=this.#e[e]?.levels??0;return(this.#t.get(e)??0)*2**-Math.max(0,t-1)}#a(e){let t=this.#e[e];return t?!t.complete&&!t.rests&&this.#i(e)>1:this.#i(e)>1&&this.#c(e)}#r(e){return 4*(this.indices[e]?.levels.reduce((t,s)=>t+s,0)??0)}#c(e){return[...this.#t.keys()].filter(s=>s!==e&&this.#e[s]).reduce((s,o)=>s+this.#r(o),this.#r(e))<=X}load(e,t,s){let o=this.#e[e],r=this.indices[e];if(r)return o||(this.#l(this.#r(e)),o=new D(this.gl,r,i=>this.site.of(i),this.fetcher,0),this.#e[e]=o),o.progress=s,o.advance(()=>!0,this.report,this.touch,t)}#l(e){let t=[...this.#e.keys()].filter(s=>this.#e[s]&&!this.#t.has(s));for(let s of t.sort((o,r)=>this.#n[o]-this.#n[r])){if(this.bytes+e<=X)return;this.#e[s]?.delete(),delete this.#e[s]}}draw(e,t,s){let{gl:o,program:r}=this,{at:i}=r;U(o,r,e),o.uniform1i(i.octree,3);let l=!1;for(let{buffers:h,batch:a}of t){let c=this.#e[a.look.octree],{cube:{low:f,side:u}}=c.index;o.activeTexture(o.TEXTURE3),o.bindTexture(o.TEXTURE_2D,c.texels[0].texture),o.activeTexture(o.TEXTURE0),o.uniform3fv(i.low,f),o.uniform1f(i.side,u),o.uniform1i(i.texels,c.count),o.uniform1i(i.deepest,c.levels-1),o.uniform1i(i.partial,0),o.bindVertexArray(h.vertexArray),l=s(i,a)||l,h.draw(a)}return l}};function q(n,e,t,s,o,r,i,l=0){let h=0,a=s;for(let c=s+1;c<=r;c++){l+=n[t+c];let f=l/Math.max(e[t+c]-o,1);l>0&&f>=h&&(h=f,a=c)}i.density=h,i.column=a,i.preview=-1}function Z(n,e){let t=0,s=0;for(let r of e)t+=Math.max(r.left,0),s+=+!r.waits;let o=n.latency+.2/2;return s<n.concurrency&&(t===0||8*t<o*n.bandwidth)}function J({latency:n,bandwidth:e,concurrency:t}){let s=n>0?n*e/8/t:0;return 300+Math.floor(Math.min(s,1048576))}function be(n,e,t){let s={density:0,number:-1,bytes:0,end:0};for(let{number:o,levels:r,following:i,finest:l,share:h}of n){let{ends:a,differences:c}=e[o],f=Float64Array.from(a,(p,v)=>h*Math.max(Number(c?.[v])||0,.5)),u=Float64Array.from(a,(p,v)=>a[Math.max(v+1,i)-1]),m=r?a[r-1]:0,d={density:0,texture:-1,column:0,preview:-1};q(f,u,-1,r,m-t,l,d);let x=Math.max(d.column,i);d.density>s.density&&(s={density:d.density,number:o,bytes:a[x-1]-m,end:x})}return s}function Q(n,e){let{client:t,client:{catalogue:{K:s,ends:o},downloads:r},index:{octrees:i=[]},stream:l}=n,{next:h}=Object.getPrototypeOf(t),a=({kind:c,number:f,begin:u})=>c==="texture"&&u>=o[f*s+Math.max(t.target[f],t.column[f])];e.competes=()=>n.policy==="best"&&!l.rests,t.next=c=>{if(!e.competes()||!n.begun)return h.call(t,c);for(;Z(c,r.waiting);){let f=h.call(t,c),{density:u,number:m,bytes:d,end:x}=be(e.wanted,i,J(c));if(m<0||f&&f.priority>=u&&!a(f))return f;f&&t.failed(f);let p={kind:"octree",number:m,begin:0,end:d,priority:u,left:d};r.waiting.add(p),e.load(m,x,p)?.finally(()=>{r.waiting.delete(p),l.pump()})}return null}}function Vt(n){let{gl:e,index:t,picture:s,picture:{renderer:o},stream:{site:r,fetcher:i}}=n,l=()=>s.touch(),h=new L(e,t.octrees??[],r,i,n.report,l,o);o.statues=h,new URLSearchParams(location.search).get("octrees")==="best"&&Q(n,h)}export{Vt as show};
